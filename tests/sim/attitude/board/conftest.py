"""Shared by the tests of the complete board: a small one, 16 times as fast as the real one."""

import pytest

from boresight.sim.attitude.board.build import Board
from boresight.sim.attitude.board.run import BoardRun, Stimulus, run_board, stimulus
from boresight.sim.attitude.worlds import synthetic_log
from tests.support.attitude.board.shared import COMPLEMENTARY, shared_board

UPDATES = 320


@pytest.fixture(scope="session")
def board() -> Board:
    """The one of several files."""
    return shared_board()


@pytest.fixture(scope="session")
def what(board: Board) -> Stimulus:
    """What the devices send."""
    return stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3), board)


@pytest.fixture(scope="session")
def plain(board: Board, what: Stimulus) -> BoardRun:
    """An ordinary run: a filter chosen, headings, every update sent."""
    settings = {"filter": COMPLEMENTARY, "output_divider": 1}
    return run_board(board, what, updates=UPDATES, settings=settings)
