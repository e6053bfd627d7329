"""A program that reads what another one of its core keeps, through the front door."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.gateware.attitude.system.programs import system_core
from boresight.model.resolve import estimator_of
from boresight.sim.attitude.board.build import make_board
from boresight.sim.attitude.board.run import judge, run_board, stimulus
from boresight.sim.attitude.board.setup import SCALED
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Column

FILE = str(Path(__file__).with_name("pointing.py"))
#: Where the satellite stands: south, 30 deg high, in words of 30 fraction bits.
SKY = {"east": 0, "north": -round(3**0.5 / 2 * 2**30), "up": 1 << 29}


@pytest.fixture(scope="module")
def board():
    """The sensors, the filter and the program that reads it."""
    return make_board(SCALED, core=system_core(["mekf", FILE]))


def test_on_the_board(board) -> None:
    """Every frame is what the models say; azimuth and elevation are those of the attitude."""
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=1, acceleration=0.3), board)
    settings = {"filter": 1, "output_divider": 1, **{f"feed_{k}": v for k, v in SKY.items()}}
    run = run_board(board, what, updates=80, settings=settings)
    verdict = judge(board, what, run, filter=1, source=2, feed=SKY)
    assert (verdict.mismatches, verdict.first) == (0, "")
    assert verdict.updates == len(run.frames) == 80 and run.frames.shape[1] == 2 + 3
    predicted = board.system.latency_cycles(1) - board.system.transfer_cycles
    assert verdict.core_cycles == (predicted, predicted)
    # Without its set of registers the program has another record.
    other = judge(board, what, run, filter=1, source=2, feed={**SKY, "up": 1 << 28})
    assert other.mismatches > 80


def test_the_register_map_names_them(board) -> None:
    registers = board.system.map()
    for name in SKY:
        outcome = registers.find(f"feed_{name}")
        assert (outcome.frac, outcome.low, outcome.high, outcome.reset) == (30, -1.0, 1.0, 0)
        assert outcome.address in range(0x700, 0x703) and outcome.access == "write-only"
    assert {f.name for f in registers.find("order").fields} >= {"take_feed", "restart_filter"}
    # Places that mean one thing for the filter and another for the program.
    assert registers.find("result_0").meaning == "output pitch (mekf); output azimuth (pointing)"
    assert registers.find("result_qx").frac == 31
    assert [p.name for p in registers.programs[1].inputs] == ["east", "north", "up"]


def test_check_on_every_level() -> None:
    """In turns with the filter whose attitude it reads, bit by bit and within tolerances."""
    walk = read_record(bundled("ximu_walk")).head(400)
    rng = np.random.default_rng(8)
    sky = rng.normal(size=(len(walk), 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    columns = {name: Column(sky[:, k]) for k, name in enumerate(SKY)}
    record = replace(walk, columns={**walk.columns, **columns})
    mekf, pointing = boresight.check(f"mekf,{FILE}", record, simulator="verilator")
    for result in (mekf, pointing):
        assert result.good
        assert [(x.level, x.n_total, x.n_mismatch) for x in result.levels] == [
            (level, 400, 0) for level in ("fixed", "c", "rtl")
        ]
    # It has seen attitudes, not their start.
    assert np.ptp(pointing.fixed.outputs["azimuth"]) > 0.5


def test_the_program_alone_is_like_any_other() -> None:
    e = estimator_of(FILE)
    program = e.compile()
    assert program.streamed == program.inputs
    rng = np.random.default_rng(4)
    q = rng.normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    sky = rng.normal(size=(50, 3))
    sky /= np.linalg.norm(sky, axis=1, keepdims=True)
    columns = {f"q{a}": q[:, k] for k, a in enumerate("wxyz")}
    columns |= {name: sky[:, k] for k, name in enumerate(("east", "north", "up"))}
    assert all(r.good for r in boresight.check(FILE, columns, levels=("fixed", "c")))
