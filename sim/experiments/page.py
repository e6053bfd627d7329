"""The page of an experiment: its targets, then sections of text, table and figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.sim.experiments.experiment import Target
from boresight.sim.pages import Section, page

__all__ = ["Section", "numbers", "render"]


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
        title=f"Experiment {name}",
        intro=intro,
        targets=targets,
        judged=[t for t in targets if t.judged],
        sources=list(sources),
        noted=any(t.note for t in targets),
        sections=sections,
        note="",
    )
