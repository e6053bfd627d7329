"""Shared by the tests of the complete board: a small one, 16 times as fast as the real one."""

import pytest

from boresight.sim.board.build import Board, make_board
from boresight.sim.board.run import BoardRun, Stimulus, run_board, stimulus
from boresight.sim.board.setup import SCALED
from boresight.sim.worlds.synthetic import synthetic_log

UPDATES = 400


@pytest.fixture(scope="session")
def board() -> Board:
    """Two filters."""
    return make_board(SCALED, filters=("complementary", "mekf"), restarts=1)


@pytest.fixture(scope="session")
def what(board: Board) -> Stimulus:
    """What the devices send."""
    return stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3), board)


@pytest.fixture(scope="session")
def plain(board: Board, what: Stimulus) -> BoardRun:
    """An ordinary run: filter 1, headings, every update sent."""
    return run_board(board, what, updates=UPDATES, settings={"filter": 1, "output_divider": 1})
