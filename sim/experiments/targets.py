"""Targets of an experiment: read from ``targets.csv`` beside its code, and as a page."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from boresight.sim.experiments.experiment import Target
from boresight.sim.plotting import Section, Verdict, number, page_of, section_of, unit


def targets_of(
    place: str | Path,
    figures: Mapping[str, float],
    spreads: Mapping[str, tuple[float, float]] | None = None,
    **counts: float,
) -> tuple[Target, ...]:
    """The rows of the ``targets.csv`` of a package, or of a folder, judged by the figures.

    Columns: ``figure``, ``name``, ``source``, ``low``, ``high``; if the table has them also
    ``part``, ``over`` and ``less`` (the figure is divided by that one, or less that one), ``unit``,
    ``note``, ``reported`` ("yes": a claim of others that does not bind), ``runs`` and
    ``hours`` (the band is that of so many; with fewer, by ``counts``, it is not judged). Any other
    column holds the same figure from another source, which its head names. ``spreads``: least and
    greatest of the runs, by figure. A figure that is missing is not a number.
    """
    folder = files(place) if isinstance(place, str) else place
    text = folder.joinpath("targets.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    return tuple(_target(row, figures, spreads or {}, counts) for row in rows)


_COLUMNS = frozenset(
    ("figure", "name", "part", "source", "low", "high", "over", "less")
    + ("unit", "note", "reported", "runs", "hours")
)


def _target(
    row: Mapping[str, str],
    figures: Mapping[str, float],
    spreads: Mapping[str, tuple[float, float]],
    counts: Mapping[str, float],
) -> Target:
    value, spread = figures.get(row["figure"], math.nan), spreads.get(row["figure"])
    if row.get("over"):
        value, spread = value / figures[row["over"]], None
    if row.get("less"):
        value, spread = value - figures[row["less"]], None
    needs = [f"{row[k]} {k}" for k, n in counts.items() if n < float(row.get(k) or 0)]
    return Target(
        name=row["name"],
        part=row.get("part", ""),
        source=row["source"],
        value=value,
        low=float(row["low"]) if row["low"] else None,
        high=float(row["high"]) if row["high"] else None,
        unit=row.get("unit", ""),
        binding=row.get("reported") != "yes",
        beside={head: float(text) for head, text in row.items() if head not in _COLUMNS and text},
        spread=spread,
        note=row.get("note", ""),
        needs=", ".join(needs),
    )


def render(
    name: str, intro: Sequence[str], targets: Sequence[Target], sections: Sequence[Section]
) -> str:
    """HTML text that needs nothing else: sections, then targets.

    A target without limits is shown and not judged.
    """
    judged = [target for target in targets if target.judged]
    met = f"Targets met: {sum(target.good for target in judged)} of {len(judged)}."
    table = section_of("Targets", target_rows(targets))
    return page_of(f"Experiment {name}", [*intro, met], [*sections, table])


def target_rows(targets: Iterable[Target]) -> list[dict[str, object]]:
    """Targets as rows of a table."""
    rows, before = list[dict[str, object]](), ("", "", "")
    for target in targets:
        text = "pass" if target.good else "FAIL" if target.binding else "miss"
        verdict = Verdict(text, target.good) if target.judged else None
        least = "" if target.spread is None else " to ".join(number(v, 3) for v in target.spread)
        said = target.name, target.source, target.note
        note, before = target.note if said != before else "", said  # of parts: it stands once
        row: dict[str, object] = {
            "what": f"{target.name}, {target.part}" if target.part else target.name,
            "source": target.source,
            "value": f"{number(target.value, 3)} {unit(target.unit)}".rstrip(),
            "runs, least to most": least or None,
            **target.beside,
            "target": target.limits or None,
            "verdict": verdict or (f"not judged: needs {target.needs}" if target.needs else None),
            "note": "; ".join(filter(None, ["reported" * (not target.binding), note])) or None,
        }
        rows.append(row)
    return rows
