"""The complete board with a core of depth 9: registers behind memories, words that wait for it."""

from functools import lru_cache
from typing import Any

import pytest

from boresight.gateware.system.programs import system_core
from boresight.model.declarations import Input, Output
from boresight.model.estimator import Estimator
from boresight.sim.board.build import Board, make_board
from boresight.sim.board.run import judge, run_board, stimulus
from boresight.sim.board.setup import SCALED
from boresight.sim.worlds.synthetic import synthetic_log
from tests.support.board.shared import Odd


class Rate(Estimator):
    """A record of one word: the choice of the next program may not overtake it."""

    inputs = (Input("gx", -100.0, 100.0, "rad/s"),)
    outputs = (Output("rate", "rad/s"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"rate": 0.75 * u.gx}


FILTERS = (Odd, "complementary", Rate)


@lru_cache
def deep_board() -> Board:
    """Three estimators on a deep core."""
    return make_board(SCALED, core=system_core(FILTERS, config="small-d9", restarts=0))


@pytest.mark.parametrize("number", range(len(FILTERS)))
def test_every_frame_equals_the_models_in_the_stated_time(number: int) -> None:
    board = deep_board()
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3), board)
    registers = board.system.plan.feed.registers
    feed = {name: 1000 + k for k, name in enumerate(registers)}
    settings = {"filter": number, "output_divider": 1} | {f"feed_{n}": v for n, v in feed.items()}
    run = run_board(board, what, updates=200, settings=settings)
    verdict = judge(board, what, run, filter=number, source=2, feed=feed)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert verdict.updates == 200 and verdict.fields >= 1 and run.dropped == 0
    cycles = verdict.transfer_cycles[0] + verdict.core_cycles[0]
    assert (cycles, *verdict.core_cycles) == (
        board.system.latency_cycles(number),
        verdict.core_cycles[0],
        verdict.core_cycles[0],
    )
