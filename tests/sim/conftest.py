"""A small core with made-up synthesis results, and runs over a bundled log, for the report."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import Core, build_core
from boresight.gateware.synthesis.area import Area
from boresight.gateware.synthesis.delays import Delay
from boresight.gateware.synthesis.device import XC6SLX9
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.synthesis.timing import PathPoint, Timing, TimingPath
from boresight.model.estimator import input_words
from boresight.model.estimators.complementary import Complementary
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.report.accuracy import Replay
from boresight.sim.report.data import assemble
from boresight.sim.report.extremes import Extremes, observe

STEPS = 300


@pytest.fixture(scope="session")
def core() -> Core:
    return build_core(Complementary().compile(), "fast", urgent=Complementary.urgent, restarts=1)


@pytest.fixture(scope="session")
def small_core() -> Core:
    return build_core(Complementary().compile(), "small", urgent=3, restarts=1)


@pytest.fixture(scope="session")
def words(core: Core) -> np.ndarray:
    estimator = Complementary()
    real = feed(estimator, read_record(bundled("synthetic_60s"))).inputs[:STEPS]
    return input_words(core.program, real[:, :, None])[:, :, 0]


@pytest.fixture(scope="session")
def replay(core: Core, words: np.ndarray) -> Replay:
    log, estimator = read_record(bundled("synthetic_60s")), Complementary()
    reference = estimator.run_float(feed(estimator, log).inputs[:STEPS, :, None]).outputs
    return Replay.of_words(
        core.program,
        log,
        CModel(core.program).update(words)[0],
        reference={k: v[:, 0] for k, v in reference.items()},
        truth=True,
    )


@pytest.fixture(scope="session")
def extremes(core: Core, words: np.ndarray) -> Extremes:
    return observe(core.program, {"synthetic_60s": words})


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Four corners and an area that nobody measured."""
    area = Area(
        lut_logic=801,
        lut_inv=2,
        lut_srl=0,
        lut_ram=0,
        route_through=0,
        ff=507,
        carry4=40,
        muxf7=0,
        muxf8=0,
        dsp=8,
        ramb16_cells=10,
        ramb8_cells=3,
        special={"BUFG": 1},
        cells={"LUT6": 801, "INV": 2},
    )
    points = (
        PathPoint(
            cell="sequencer.rom",
            type="RAMB16BWER",
            entry="CLK",
            exit="DO",
            cell_ns=2.1,
            total_ns=2.1,
            keys=("ramb_clk_do",),
        ),
        PathPoint(
            cell="$abc$1",
            type="LUT6",
            entry="I0",
            exit="O",
            net="lane0.<i>",
            fanout=14,
            net_ns=1.1,
            cell_ns=0.259,
            total_ns=3.459,
            keys=("net", "lut"),
        ),
    )
    guess = {"ramb_clk_do": Delay(ns=2.1, source="guess & nothing else", guessed=True)}

    def corner(grade: int, nets: str, delay: float) -> Timing:
        path = TimingPath(
            start="a.memory",
            end="b.memory",
            group="FDRE.D",
            delay_ns=delay,
            slack_ns=10.0 - delay,
            points=points,
        )
        return Timing(
            grade=grade,
            nets=nets,
            period_ns=10.0,
            worst=path,
            ends=(path,),
            groups=(),
            guessed=guess,
            clocks=("clk",),
        )

    return Estimate(
        top="core",
        device=XC6SLX9,
        area=area,
        command="yosys -p synth",
        version="Yosys 0.70 (git sha1 0123abc, Release, g++ 12)",
        warnings=("timing is a guess",),
        timing=(
            corner(2, "median", 8.0),
            corner(2, "p75", 12.5),
            corner(3, "median", 7.0),
            corner(3, "p75", 11.0),
        ),
    )


@pytest.fixture(scope="session")
def verification(core: Core) -> list[dict[str, Any]]:
    latency, interval = core.schedule.latency, core.schedule.interval
    return [
        {"level": "c", "simulator": "gcc", "n_total": STEPS, "n_mismatch": 0, "seconds": 0.25},
        {
            "level": "rtl",
            "simulator": "verilator",
            "n_total": STEPS,
            "n_mismatch": 0,
            "seconds": 3.5,
            "cycles_predicted": latency,
            "cycles_min": latency,
            "cycles_max": latency,
            "interval_predicted": interval,
            "interval_max": interval,
        },
    ]


@pytest.fixture(scope="session")
def report(
    core: Core,
    estimate: Estimate,
    verification: list[dict[str, Any]],
    replay: Replay,
    extremes: Extremes,
) -> dict[str, Any]:
    """A report with every part; tests must not change it."""
    return assemble(
        core,
        estimate=estimate,
        verification=verification,
        replays=[replay],
        extremes=extremes,
        firmware={"updates_per_s": 4.5e6, "source": "measured: boresight bench"},
        command="boresight report complementary <log>",
    )
