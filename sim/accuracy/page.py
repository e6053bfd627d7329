"""The page of `boresight accuracy`: errors of every estimator, and on every log."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.sim.pages import Section, Verdict, page_of, section_of
from boresight.sim.plotting import dots
from boresight.sim.result import Result

__all__ = ["render_page"]


def render_page(result: Result) -> str:
    """The page's text, which needs no other file."""
    rows = [row for row in result["estimators"] if row["level"] != "float"]
    logs = [log["trial"] for log in result["logs"]]
    errors: dict[str, str] = {name: unit for row in rows for name, unit in row["units"].items()}
    sections = [section_of(title, table) for title, table in result.tables.items()]
    for name, unit in errors.items():
        series = {
            row["estimator"]: _on_logs(row, "error", name) for row in rows if name in row["units"]
        }
        label = f"error: {name} {unit}".rstrip()
        sections.append(
            Section(title=f"Error on each log: {name}", figures=[("", dots(logs, series, label))])
        )
    near = {
        f"{row['estimator']}, {d['output']} {d['unit']}".rstrip(): _on_logs(
            row, "vs_float", d["output"]
        )
        for row in rows
        for d in row["vs_float"]
        if d["tolerance"] is not None
    }
    if near:
        label = "largest difference between fixed point and float64"
        sections.append(Section(title="Fixed point", figures=[("", dots(logs, near, label))]))
    intro: list[str | Verdict] = [result["source"] + "."]
    intro += [Verdict(text, good=False) for text in result.failures]
    return page_of("Accuracy", intro, sections)


def _on_logs(row: Mapping[str, Any], key: str, name: str) -> list[float | None]:
    return [trial[key].get(name) for trial in row["trials"]]
