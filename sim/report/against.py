"""Two reports side by side: every figure that differs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.records.reading import read_bytes

__all__ = ["against_section", "read_report"]

Figure = float | str | None


def read_report(path: str | Path) -> dict[str, Any]:
    """The contents of a report.json.

    Raises
    ------
    InputError
        It cannot be read, or is no report of one estimator.
    """
    wanted = "a report.json of boresight report"
    content = read_bytes(Path(path), wanted)
    try:
        found = json.loads(content)
    except ValueError:
        found = None
    parts = ("design", "digest", "timing", "resources", "numerics", "accuracy", "firmware")
    if not isinstance(found, dict) or not all(part in found for part in parts):
        raise InputError.at(
            str(path), wanted=wanted, found="something else", fix="name the file that it wrote"
        )
    return found


def against_section(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """What differs between two reports.

    Returns
    -------
    dict
        ``rows``: figure, unit, before, after (null where a report has none), and their ratio where
        both are positive numbers; ``equal``: how many figures are the same in both.
    """
    old, new = dict(_figures(before)), dict(_figures(after))
    rows, equal = [], 0
    for name, unit in dict.fromkeys((*old, *new)):
        x, y = old.get((name, unit)), new.get((name, unit))
        if x == y:
            equal += 1
            continue
        numbers = all(isinstance(v, int | float) and v > 0 for v in (x, y))
        ratio = float(f"{y / x:.4g}") if numbers else None  # type: ignore[operator]
        rows.append({"figure": name, "unit": unit, "before": x, "after": y, "ratio": ratio})
    return {
        "before": {key: before.get(key) for key in ("design", "config", "word", "digest")},
        "rows": rows,
        "equal": equal,
    }


def _figures(data: Mapping[str, Any]) -> Iterator[tuple[tuple[str, str], Figure]]:
    """Everything that can be compared, by name and unit."""
    timing, resources, speed = data["timing"], data["resources"], data["target"]["speed"]
    yield ("word", "bits"), data["word"]
    yield ("configuration", ""), data["config"]
    yield ("log", ""), ", ".join(log["dataset"] for log in data["accuracy"]["logs"])
    yield ("latency", "cycles"), timing["latency_cycles"]["predicted"]
    yield ("interval", "cycles"), timing["interval_cycles"]
    yield ("operations", ""), data["schedule"]["ops_total"]
    for key, name in (("lut", "LUT"), ("reg", "registers"), ("dsp", "DSP"), ("blkmem", "RAM")):
        yield (name, ""), resources[key]
    if timing["fmax_mhz"] is not None:
        yield ("clock, slow nets", "MHz"), timing["fmax_mhz"].get(speed, {}).get("p75")
    yield ("C, memory", "bytes"), data["firmware"]["ram_bytes"]
    yield ("C, tables", "bytes"), data["firmware"]["table_bytes"]
    verdict = data["accuracy"]["verdict"]
    for o in verdict["outputs"] if verdict else ():
        yield (f"error of {o['output']}, largest", o["unit"]), o["max"]
        yield (f"error of {o['output']}, rms", o["unit"]), o["rms"]
    if verdict:
        yield ("updates that saturated", ""), verdict["saturated_updates"]
    for log in data["accuracy"]["logs"]:
        for o in log["truth"]:
            name = f"{o['output']} against {log['reference']} on {log['dataset']}, rms"
            yield (name, o["unit"]), o["rms"]
    for row in data["numerics"]:
        whole = row["format"].partition(",")[2].rstrip(">")
        yield (f"integer bits of {row['signal']}", ""), int(whole)
