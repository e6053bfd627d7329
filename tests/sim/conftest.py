"""A small core with made-up synthesis results, and runs over a bundled log, for the report."""

import dataclasses
from typing import Any

import pytest

from boresight.gateware.core import Core, build_core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.synthesis.spartan6.area import Area
from boresight.gateware.synthesis.spartan6.delays import Delay
from boresight.gateware.synthesis.spartan6.device import XC6SLX9
from boresight.gateware.synthesis.timing import PathPoint, Timing, TimingPath
from boresight.model.attitude.complementary import Complementary
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult, LevelResult
from boresight.sim.levels.build import Build
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.report.data import report_data

STEPS = 300


@pytest.fixture(scope="session")
def core() -> Core:
    return build_core(Complementary().compile(), "fast", urgent=Complementary.urgent, restarts=1)


@pytest.fixture(scope="session")
def small_core() -> Core:
    return build_core(Complementary().compile(), "small", urgent=3, restarts=1)


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Four corners, and an area that was not measured."""
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
def checked() -> CheckResult:
    """The interpreter and the C on a bundled log with truth."""
    build = Build(Complementary(), config="fast")
    record = read_record(bundled("synthetic_60s")).head(STEPS)
    (result,) = Check(build, levels=("fixed", "c")).run(record)
    return result


@pytest.fixture(scope="session")
def check(checked: CheckResult, core: Core) -> CheckResult:
    """With an RTL level that did not run."""
    latency, interval = core.schedule.latency, core.schedule.interval
    cycles = {"cycles_predicted": latency, "cycles_min": latency, "cycles_max": latency}
    intervals = {f"interval_{name}": interval for name in ("predicted", "min", "max")}
    rtl = LevelResult("rtl", "verilator", STEPS, 0, 3.5, **cycles, **intervals)
    return dataclasses.replace(checked, levels=(checked.levels[1], rtl))


@pytest.fixture(scope="session")
def report(core: Core, estimate: Estimate, check: CheckResult) -> dict[str, Any]:
    """A report with every part; tests must not change it."""
    return report_data(core, check, area=estimate, command="boresight report complementary <log>")
