"""The page of an experiment: its targets, then sections of text, table and figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from boresight.sim.experiments.experiment import Target
from boresight.sim.pages import page

__all__ = ["Section", "numbers", "render"]


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page.

    Attributes
    ----------
    title, text : str
    columns : sequence of str
        Head of its table.
    rows : sequence of sequences
        Cells: text, or numbers, which are written as for people.
    figures : sequence of (caption, SVG)
        See `sim.plotting.svg`.
    """

    title: str
    text: str = ""
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str | float]] = ()
    figures: Sequence[tuple[str, str]] = ()


def numbers(values: Iterable[float], form: str = ".2f") -> str:
    """Several numbers as one cell."""
    return ", ".join(f"{v:{form}}" for v in values).replace("-", "\N{MINUS SIGN}")


def render(
    name: str, intro: Sequence[str], targets: Sequence[Target], sections: Sequence[Section]
) -> str:
    """HTML text that needs nothing else; a target without limits is shown and not judged."""
    sources: dict[str, None] = {}
    for target in targets:
        sources |= dict.fromkeys(target.beside)
    return page(
        "boresight.sim.experiments",
        "page.html",
        name=name,
        intro=intro,
        targets=targets,
        judged=[t for t in targets if t.judged],
        sources=list(sources),
        noted=any(t.note for t in targets),
        sections=sections,
    )
