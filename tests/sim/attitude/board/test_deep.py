"""The complete board with a core of depth 9: registers behind memories, words that wait for it."""

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.attitude.system.programs import system_core
from boresight.model.declarations import Input, Output
from boresight.model.estimator import Estimator
from boresight.sim.attitude.board.build import SCALED, Board, make_board
from boresight.sim.attitude.board.chain import NO_LINE, Samples, run_chain
from boresight.sim.attitude.board.run import judge, run_board, stimulus
from boresight.sim.attitude.worlds import synthetic_log
from tests.support.attitude.board.shared import Odd
from tests.support.attitude.conductor_bench import play, sample_command


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
    return make_board(SCALED, core=system_core(FILTERS, config="small-d9"))


@pytest.mark.parametrize("number", range(len(FILTERS)))
def test_every_frame_equals_the_models_in_the_stated_time(number: int) -> None:
    board = deep_board()
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3), board)
    registers = board.system.plan.feed.registers
    feed = {name: 1000 + k for k, name in enumerate(registers)}
    settings = {"filter": number, "output_divider": 1} | {f"feed_{n}": v for n, v in feed.items()}
    run = run_board(board, what, updates=160, settings=settings)
    verdict = judge(board, what, run, filter=number, source=2, feed=feed)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert verdict.updates == 160 and verdict.fields >= 1 and run.dropped == 0
    cycles = verdict.transfer_cycles[0] + verdict.core_cycles[0]
    assert (cycles, *verdict.core_cycles) == (
        board.system.latency_cycles(number),
        verdict.core_cycles[0],
        # Before its first update a program loads its states; program 0 does so after the reset.
        verdict.core_cycles[0] + (board.core.image.restarts[number] if number else 0),
    )


def test_writes_of_the_host_in_any_cycle_of_an_update() -> None:
    """Also when a write delays a record of one word."""
    core = system_core([Rate, "complementary"], config="small-d9")
    (calibrate,) = (k for k, p in enumerate(core.parts) if p.program.name == "calibrate_inertial")
    address = core.select(calibrate).parameter_addresses["gyro_bias_z"]
    script = ["o 0", "u 1", "f 0", "w 10"]
    cuts = range(40, 110)
    for k, wait in enumerate(cuts):
        counts = (100 + k, 0, 0, 0, 0, 1000)
        script += [sample_command(100_000 * k, counts), f"w {wait}", *[f"b {address} 0"] * 2]
        script += [f"n {k + 1}", "w 100"]
    played = play(core, script)
    n = len(cuts)
    samples = Samples(
        stamp=100_000 * np.arange(n),
        counts=np.array([(100 + k, 0, 0, 0, 0, 1000) for k in range(n)]),
        line=np.full(n, NO_LINE),
        values=np.zeros((n, 3), dtype=np.int64),
        restart=np.arange(n) == 0,
        filter=np.zeros(n, dtype=np.int64),
    )
    wanted = run_chain([part.program for part in core.parts], samples).outputs[:, :1]
    # The bench looks a cycle after the index; the word comes after two.
    assert (played.words(Place.OUTPUTS + 1, 1) == wanted).all() and np.ptp(wanted) > 0
    assert not played.named("framing")
