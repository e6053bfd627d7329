"""What a campaign found, as a page to read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from tests.mutants.campaign import Done
from tests.mutants.edits import Mutant

Figures = dict[str, int]


def figures(done: Sequence[Done], group: str) -> Figures:
    """Counts of a group: tried, noticed, by the nearest tests, over time, survived."""
    verdicts = Counter(d.verdict.verdict for d in done if d.group == group)
    return {
        "tried": verdicts.total() - verdicts["error"],
        "noticed": sum(verdicts[name] for name in ("nearest", "wider", "time")),
        "nearest": verdicts["nearest"],
        "over time": verdicts["time"],
        "survived": verdicts["survived"],
        "error": verdicts["error"],
    }


def render(
    done: Sequence[Done],
    samples: Mapping[str, Sequence[Mutant]],
    known: Mapping[str, str],
    *,
    seed: int,
    command: str,
) -> str:
    """Markdown: figures, survivors, equivalent ones that the sample had."""
    lines = [
        f"# Mutants, seed {seed}",
        "",
        f"`{command}`",
        "",
        "| group | sample | equivalent | tried | noticed | by the nearest tests | over time |",
        "|---|---|---|---|---|---|---|",
    ]
    for group, drawn in samples.items():
        row = figures(done, group)
        share = f" ({row['noticed'] / row['tried']:.1%})" if row["tried"] else ""
        lines.append(
            f"| {group} | {len(drawn)} | {sum(m.key in known for m in drawn)} | {row['tried']} | "
            f"{row['noticed']}{share} | {row['nearest']} | {row['over time']} |"
        )
    lines += ["", "## Survivors", ""]
    survivors = [d for d in done if not d.verdict.noticed]
    lines += [line for d in survivors for line in _item(d.mutant, d.verdict.by)] or ["None.", ""]
    lines += ["## Equivalent", ""]
    equal = [m for drawn in samples.values() for m in drawn if m.key in known]
    lines += [line for m in equal for line in _item(m, known[m.key])] or ["None.", ""]
    return "\n".join(lines)


def _item(mutant: Mutant, reason: str = "") -> list[str]:
    return [
        f"* `{mutant.file}:{mutant.line}` {mutant.kind}, in `{mutant.scope}`"
        + (f": {reason}" if reason else ""),
        "",
        "  ```",
        f"  {mutant.statement}",
        f"  {mutant.old}  ->  {mutant.new}",
        f"  key: {mutant.key}",
        "  ```",
        "",
    ]
