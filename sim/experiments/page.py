"""The page of an experiment: its targets, then sections of text, table and figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.seeds import Runs
from boresight.sim.pages import Section, page

__all__ = ["Section", "numbers", "render", "render_cases"]


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


def render_cases(
    name: str,
    intro: Sequence[str],
    targets: Sequence[Target],
    outcomes: Mapping[str, Runs],
    *,
    seed: int,
    runs: int,
    meanings: Mapping[str, str],
    columns: Mapping[str, str],
    text: str,
    plots: Mapping[str, str],
) -> str:
    """HTML text of an experiment with cases of many seeds: a row for each, plots of first runs.

    Parameters
    ----------
    intro : sequence of str
        May hold {runs}, {seed} and {last}.
    outcomes : mapping
        The runs of each case.
    meanings : mapping
        Of each case, in the order of the rows.
    columns : mapping
        Head to figure (`Runs.pooled`).
    text, plots
        What the plots show; SVG by case.
    """
    pooled = {case: outcomes[case].pooled() for case in meanings}
    rows: list[list[str | float]] = [
        [meaning, *(pooled[case][key] for key in columns.values())]
        for case, meaning in meanings.items()
    ]
    figures = [(meanings[case], plot) for case, plot in plots.items()]
    return render(
        name,
        [line.format(runs=runs, seed=seed, last=seed + runs - 1) for line in intro],
        targets,
        [
            Section(title="Cases", columns=("", *columns), rows=rows),
            Section(title="First run", text=text, figures=figures),
        ],
    )
