"""`python -m tests.mutants`: a random sample of mutants, and a page of those that nothing noticed.

With ``--witness`` of the parts that make a compiled core, and by the proofs or the search alone.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path

from tests.mutants.campaign import Record, run, sample, unsound
from tests.mutants.equivalent import equivalents, stale
from tests.mutants.groups import GROUPS, all_mutants
from tests.mutants.page import figures, render
from tests.mutants.trial import Verdict
from tests.mutants.witnesses import PARTS, WITNESSES

ROOT = Path(__file__).parents[2]


def main(arguments: list[str] | None = None) -> int:
    """0: every mutant was noticed; 1: some survived, or the tests fail without any."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=1, help="of the sample (default 1)")
    parser.add_argument("--count", type=int, default=40, help="mutants of each group (default 40)")
    parser.add_argument("--group", choices=[*GROUPS, *PARTS], help="only this one")
    parser.add_argument("--witness", choices=WITNESSES, help="this alone, not the tests")
    parser.add_argument("--only", default="", help="draw from files whose path holds this")
    parser.add_argument("--jobs", type=int, default=2, help="workers (default 2)")
    parser.add_argument("--limit", type=float, default=1200, help="seconds for one mutant's tests")
    parser.add_argument("-o", type=Path, default=Path("build/mutants"), help="folder of the page")
    given = parser.parse_args(arguments)

    known = equivalents()
    everything = PARTS if given.witness else GROUPS
    if given.group and given.group not in everything:
        parser.error(f"--group {given.group}: one of {', '.join(everything)}")
    groups = [given.group] if given.group else list(everything)
    old = stale(known, (m.key for g in GROUPS.values() for m in all_mutants(ROOT, g)))
    for key in old:
        print(f"equivalent.toml: no such mutant any longer: {key}")
    samples = {
        g: sample(ROOT, g, everything[g], given.seed, given.count, given.only) for g in groups
    }
    folder = given.o.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    options = {"limit_s": given.limit, "cache": folder / "cache"}
    by = f"-{given.witness}" if given.witness else ""
    record = Record(folder / f"verdicts{by}.jsonl", ROOT)
    done = run(
        ROOT,
        samples,
        known,
        record,
        jobs=given.jobs,
        say=lambda text: print(text, flush=True),
        witness=WITNESSES[given.witness] if given.witness else None,
        **options,
    )
    command = shlex.join(["python", "-m", "tests.mutants", *(arguments or sys.argv[1:])])
    page = folder / f"seed-{given.seed}{by}.md"
    page.write_text(render(done, samples, known, seed=given.seed, command=command), "utf-8")
    for group in groups:
        row = figures(done, group)
        print(f"{group}: {row['noticed']} of {row['tried']} noticed, {row['nearest']} by nearest")
    print(f"wrote {page}")
    broken = unsound(ROOT, done, **options)
    if broken:
        print(f"error: fails without a mutant: {broken}", file=sys.stderr)
        for each in done:  # said nothing; to be tried again
            if each.verdict.by == broken:
                record.add(each.mutant, Verdict("error", "fails without a mutant"))
    return int(bool(broken or old or any(not d.verdict.noticed for d in done)))


if __name__ == "__main__":
    sys.exit(main())
