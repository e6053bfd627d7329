"""Two reports side by side: every figure that differs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.baseline import Figure, compared
from boresight.sim.records.reading import read_json

__all__ = ["FIGURES", "JUDGED", "against_section", "read_report"]

_PROGRAM = {
    "word": Figure("word", "", "bits"),
    "config": Figure("configuration", ""),
    "timing.latency_cycles_by_output.*": Figure("latency", "cycles", "cycles"),
    "timing.interval_cycles": Figure("interval", "cycles", "cycles"),
    "schedule.ops_total": Figure("operations", ""),
    "resources.lut": Figure("LUT", "area"),
    "resources.reg": Figure("registers", "area"),
    "resources.dsp": Figure("DSP", "area"),
    "resources.blkmem": Figure("RAM", "area"),
    "timing.fmax_mhz.*.p75": Figure("clock, slow nets", "clock", "MHz", falls=True),
    "timing.fmax_mhz.*.routed": Figure("clock, routed", "clock", "MHz", falls=True),
    "firmware.ram_bytes": Figure("C, memory", "area", "bytes"),
    "firmware.table_bytes": Figure("C, tables", "area", "bytes"),
    "accuracy.verdict.outputs.*.max": Figure("largest error", "error"),
    "accuracy.verdict.outputs.*.rms": Figure("error, rms", "error"),
    "accuracy.verdict.saturated_updates": Figure("updates that saturated", "count"),
    "accuracy.logs.*.dataset": Figure("log", ""),
    "accuracy.logs.*.truth.*.rms": Figure("error against truth, rms", "error"),
    "numerics.*.format": Figure("format", ""),
}
_IDENTITY = {name: Figure(name, "same") for name in ("design", "config", "word")}


def _with_programs(figures: Mapping[str, Figure]) -> dict[str, Figure]:
    """Figures by their place in a report of one program, and of several."""
    return {
        f"{of}{place}": figure for of in ("", "programs.*.") for place, figure in figures.items()
    }


#: Figures by which two reports are compared.
FIGURES = _with_programs(_PROGRAM)
#: Figures that are judged against an earlier report.
JUDGED = _with_programs({place: f for place, f in _PROGRAM.items() if f.kind} | _IDENTITY)


def read_report(path: str | Path) -> dict[str, Any]:
    """The contents of a report.json.

    Raises
    ------
    InputError
        It cannot be read, or is no report of one estimator.
    """
    wanted = "a report.json of boresight report"
    data = read_json(path, wanted)
    parts = ("design", "digest", "timing", "resources", "numerics", "accuracy", "firmware")
    if not isinstance(data, dict) or not all(part in data for part in parts):
        raise InputError.at(
            str(path), wanted=wanted, found="something else", fix="name the file that it wrote"
        )
    return data


def against_section(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Differences of two reports.

    Returns
    -------
    dict
        ``rows``: figure, unit, before, after (null where a report has none), and their ratio where
        both are positive numbers; ``equal``: how many figures are the same in both.
    """
    comparison = compared(after, before, FIGURES, file="")
    rows = []
    for c in comparison.changes:
        numeric = isinstance(c.before, float) and isinstance(c.now, float) and c.before > 0 < c.now
        ratio = float(f"{c.now / c.before:.4g}") if numeric else None  # type: ignore[operator]
        row = {"figure": c.figure, "unit": c.unit, "before": c.before, "after": c.now}
        rows.append({**row, "ratio": ratio})
    return {
        "before": {key: before.get(key) for key in ("design", "config", "word", "digest")},
        "rows": rows,
        "equal": comparison.equal,
    }
