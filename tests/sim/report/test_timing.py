"""`sim.report.timing`: cycles counted over levels, clocks by grade and nets."""

from __future__ import annotations

import dataclasses
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.synthesis.estimate import Estimate
from boresight.sim.compare.results import LevelResult
from boresight.sim.report.timing import timing_section


def section(core: Core, *levels: LevelResult, **more: Any) -> tuple[dict[str, Any], list[str]]:
    warnings: list[str] = []
    options = {"estimate": None, "clock_mhz": 100.0, "grade": 2} | more
    return timing_section(core, levels=levels, warn=warnings.append, **options), warnings


def level(least: int, most: int, interval: int, error: str = "") -> LevelResult:
    counted = {"cycles_min": least, "cycles_max": most, "interval_max": interval}
    return LevelResult("rtl", "verilator", 9, 0, 1.0, 5, error=error, **counted)


def test_counts_are_those_of_all_levels_that_ran(core: Core) -> None:
    plain = LevelResult("c", "gcc", 9, 0, 1.0)
    broken = level(1, 999, 999, "broken")
    found, warnings = section(core, plain, level(200, 210, 300), level(190, 205, 310), broken)
    assert found["latency_cycles"] == {
        "predicted": core.schedule.latency, "min": 190, "max": 210,
    }  # fmt: skip
    assert found["interval_cycles_counted"] == 310
    assert warnings == [f"cycles: predicted {core.schedule.latency}, counted 190 to 210"]
    assert found["critical_path"] is None and found["fmax_mhz"] is None


def test_no_longest_path(core: Core, estimate: Estimate) -> None:
    none = dataclasses.replace(
        estimate, timing=tuple(dataclasses.replace(t, worst=None) for t in estimate.timing)
    )
    found, warnings = section(core, estimate=none, clock_mhz=50.0)
    assert found["critical_path"] is None
    assert set(found["fmax_mhz"]) == {"-2", "-3"} == set(found["update_us_at_fmax"])
    assert not any(w.startswith("clock") for w in warnings)
    assert found["update_us"] == round(core.schedule.latency / 50.0, 4)
