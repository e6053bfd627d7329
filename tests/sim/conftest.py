"""A small core with made-up synthesis results, and runs over a bundled log, for the report."""

import dataclasses
from typing import Any

import pytest

from boresight.gateware.core import Core, build_core
from boresight.gateware.synthesis.family import ClockEstimate, Step
from boresight.gateware.synthesis.routed import Mapped
from boresight.gateware.synthesis.targets import TARGETS
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
    return build_core(Complementary().compile(), "fast", urgent=Complementary.urgent)


@pytest.fixture(scope="session")
def small_core() -> Core:
    return build_core(Complementary().compile(), "small", urgent=3)


@pytest.fixture(scope="session")
def estimate() -> Mapped:
    """An area and a clock that were not measured."""
    path = (
        Step(kind="clk-to-q", ns=2.1, start="sequencer.rom.clock", end="sequencer.rom.DO"),
        Step(kind="routing", ns=10.4, start="sequencer.rom.DO", end="lane0.D", net="lane0.<i>"),
    )
    return Mapped(
        target=TARGETS["xc6slx9"],
        netlist={},
        used={"lut": 803, "ff": 507, "dsp": 8, "ramb16": 11.5},
        inside=0,
        command="yosys -p synth",
        version="Yosys 0.70 (git sha1 0123abc, Release, g++ 12)",
        clock=ClockEstimate(125.0, 80.0, path),
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
def report(core: Core, estimate: Mapped, check: CheckResult) -> dict[str, Any]:
    """A report with every part; tests must not change it."""
    return report_data(core, check, area=estimate, command="boresight report complementary <log>")
