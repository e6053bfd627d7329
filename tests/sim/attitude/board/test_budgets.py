"""The times of the 2014 paper: each filter within them, counted by cocotb.

The paper's complementary filter takes 316 us and its Kalman filter 1.14 ms, 31,600 and 114,000
cycles at 100 MHz.
"""

from __future__ import annotations

from functools import lru_cache

import pytest

from boresight.model.resolve import estimator_of
from boresight.model.words.interpreter import Interpreter
from boresight.sim.attitude.board.build import REAL, Board, make_board
from boresight.sim.attitude.board.run import judge, stimulus
from boresight.sim.attitude.ma2014.world import CLOCK_MHZ, TIME_US
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.levels.build import Build
from boresight.sim.records.feed import feed
from boresight.sim.rtl.simulators import available
from tests.support.attitude.board.cocotb_run import run_core, run_under_cocotb

#: Filters that share a core.
CORES = (
    ("complementary", "ekf_quaternion", "ekf_bias", "mekf"),
    ("ma2014_cf", "vqf(rate_hz=1024)"),
)
FILTERS = [name for core in CORES for name in core]
#: us
BUDGETS = dict.fromkeys(FILTERS, TIME_US["kalman"])
BUDGETS |= dict.fromkeys(("complementary", "ma2014_cf"), TIME_US["complementary"])
UPDATES = 2
#: The paper's.
PAPER = ("ma2014_cf", "ekf_quaternion")


@lru_cache
def real_board(core: tuple[str, ...]) -> Board:
    return make_board(REAL, filters=[estimator_of(name) for name in core])


@pytest.mark.parametrize("name", FILTERS)
def test_from_the_sensors_pins_to_the_registers(name: str) -> None:
    """With both sensors at their real speed: the transfer of a sample is part of it."""
    core = next(core for core in CORES if name in core)
    board, number = real_board(core), core.index(name)
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1), board)
    settings = {"filter": number, "output_divider": 1}
    run, counted = run_under_cocotb(board, what, updates=UPDATES, settings=settings)
    latency = board.system.latency_cycles(number)
    # Before its first update a program loads its states; program 0 does so after the reset.
    begins = board.core.image.restarts[number] if number else 0
    assert counted == [latency + begins, *[latency] * (UPDATES - 1)]
    assert max(counted) <= BUDGETS[name] * REAL.clock_hz / 1e6
    verdict = judge(board, what, run, filter=number, source=2)
    assert (verdict.mismatches, verdict.lost, verdict.updates) == (0, 0, UPDATES)
    program = board.core.parts[number].program
    dt = program.find("dt")
    steps = program.format(dt).real(verdict.chain.records[1:, program.inputs.index(dt)])
    assert steps == pytest.approx(1.0 / REAL.rate_hz, rel=1e-4)


@pytest.mark.skipif(not available("icarus"), reason="Icarus Verilog: apt-get install iverilog")
@pytest.mark.parametrize("name", PAPER)
def test_of_the_core_alone(name: str) -> None:
    """From the first word of a record to the last urgent output."""
    log = synthetic_log(seconds=1, rate_hz=1024, seed=1).head(UPDATES)
    build = Build(estimator_of(name))
    program, schedule = build.programs[0], build.core.parts[0].schedule
    records = feed(build.estimators[0], log).words(program)
    outputs, cycles = run_core(build.core, records)
    assert outputs.tolist() == Interpreter(program).run(records[:, :, None])[0][:, :, 0].tolist()
    assert (cycles == schedule.latencies).all()
    latency = cycles[:, : schedule.urgent].max()
    assert latency == schedule.latency and latency <= BUDGETS[name] * CLOCK_MHZ
