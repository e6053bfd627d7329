"""The page of an experiment: its targets, then sections of text, table and figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.sim.experiments.experiment import Target
from boresight.sim.pages import Section, Verdict, number, page_of, section_of, unit


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
