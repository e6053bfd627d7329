"""Search for trouble for some hours, with a page that says what ran.

``python -m tests.support.soak --hours 2`` (`make soak`) takes turns: random programs through the
compiler, then each file of tests with properties or long campaigns, with new examples.

What ran is in a journal: a search that was stopped goes on with other seeds. Exit code 1 if
anything was found, also before. ``--replay FILE`` runs one failing case again.
"""

from __future__ import annotations

import argparse
import itertools
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from boresight.sim.campaign import Journal, dispatch
from boresight.sim.pages import Section, Verdict, page_of
from tests.support.soak import compiler

#: Cases of the compiler in a row of the journal; one in so many tasks runs the RTL, too.
CASES, _RTL = 20, 4
TESTS = Path(__file__).parents[2]
#: Seconds after which a file of tests has failed; pytest's exit codes for good and for no tests.
_LIMIT, _GOOD = 7200, (0, 5)


def kinds() -> list[str]:
    """What runs: the compiler, and every file with properties or long campaigns."""
    marks = ("@given", "mark.soak")
    files = (p for p in sorted(TESTS.rglob("test_*.py")) if p.parent != Path(__file__).parent)
    found = [p for p in files if any(m in p.read_text(encoding="utf-8") for m in marks)]
    return ["compiler", *(str(p.relative_to(TESTS.parent)) for p in found)]


def run(kind: str, seed: int, folder: Path) -> dict[str, Any]:
    """A row of the journal: what ran, how long it took, and what it found."""
    start, wrong, count = time.monotonic(), list[str](), CASES
    if kind == "compiler":
        rtl = seed % _RTL == 0
        for number in range(seed * CASES, (seed + 1) * CASES):
            case = compiler.drawn(number, rtl=rtl)
            if text := compiler.check(case):
                path = compiler.write(compiler.shrunk(case), text, folder)
                wrong.append(f"{case}: {text.splitlines()[0]}; --replay {path}")
    else:
        count, text = _tests(kind, seed)
        wrong += [text] if text else []
    seconds = round(time.monotonic() - start, 1)
    return {"kind": kind, "seed": seed, "cases": count, "seconds": seconds, "wrong": wrong}


def _tests(file: str, seed: int) -> tuple[int, str]:
    """Properties and campaigns of a file with new examples: how many tests, what failed."""
    command = [sys.executable, "-m", "pytest", "-q", "-m", "soak or hypothesis", file]
    options = ["--hypothesis-profile=soak", f"--hypothesis-seed={seed}", f"--timeout={_LIMIT}"]
    done = subprocess.run(
        [*command, *options, "-p", "no:cacheprovider"],
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
    )
    passed = [int(w) for w, s in zip(*_pairs(done.stdout), strict=True) if s.startswith("passed")]
    wrong = "" if done.returncode in _GOOD else f"seed {seed}: {done.stdout[-4000:]}{done.stderr}"
    return sum(passed), wrong


def _pairs(text: str) -> tuple[list[str], list[str]]:
    """Numbers, each with the word after it, of the last line."""
    words = text.splitlines()[-1].split() if text.strip() else []
    pairs = [(a, b) for a, b in zip(words, words[1:], strict=False) if a.isdecimal()]
    return [a for a, _ in pairs], [b for _, b in pairs]


def _turns(
    seeds: dict[str, int], folder: Path, end: float
) -> Iterator[tuple[str, Any, tuple[object, ...]]]:
    """Tasks until the end, with the next seeds: the first kind in every other one.

    Between them runs what has run least, so that a search that goes on begins with the rest.
    """
    for turn in itertools.count():
        if time.monotonic() >= end:
            return
        kind = min(seeds, key=seeds.__getitem__) if turn % 2 else next(iter(seeds))
        yield kind, run, (kind, seeds[kind], folder)
        seeds[kind] += 1


def page(rows: Mapping[str, dict[str, Any]]) -> str:
    """What ran, and what it found."""
    lines, wrong = list[tuple[str | float | Verdict, ...]](), list[tuple[str, str]]()
    for kind in sorted({r["kind"] for r in rows.values()}):
        own = [r for r in rows.values() if r["kind"] == kind]
        bad = [(kind, text) for r in own for text in r["wrong"]]
        wrong += bad
        lines.append(
            (
                kind,
                sum(r["cases"] for r in own),
                sum(r["seconds"] for r in own),
                f"{min(r['seed'] for r in own)} to {max(r['seed'] for r in own)}",
                Verdict(str(len(bad)), not bad),
            )
        )
    hours = sum(r["seconds"] for r in rows.values()) / 3600.0
    good = Verdict(f"{len(wrong)} findings in {hours:.2f} hours of work", not wrong)
    columns = ("what ran", "cases or tests", "seconds", "seeds", "findings")
    sections = [Section(title="What ran", columns=columns, rows=lines)]
    if wrong:
        sections.append(Section(title="Findings", columns=("in", "what"), rows=wrong))
    return page_of("Soak", [good], sections)


def main(arguments: list[str] | None = None) -> int:
    """See the module docstring."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.soak", description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--jobs", type=int, help="processes; by default one for each processor")
    parser.add_argument(
        "--only", help="what has this text in its name: compiler, tests/sim/records"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("build/soak"))
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run one failing case again")
    options = parser.parse_args(arguments)
    if options.replay is not None:
        wrong = compiler.check(compiler.read(options.replay))
        print(wrong or "good")
        return int(bool(wrong))
    folder, end = options.output, time.monotonic() + 3600.0 * options.hours
    journal = Journal(folder / "journal.jsonl")
    chosen = [k for k in kinds() if options.only is None or options.only in k]
    parser.error(f"--only {options.only}: nothing has this in its name") if not chosen else None
    seeds = dict.fromkeys(chosen, 0)
    for row in journal.rows.values():
        if row["kind"] in seeds:
            seeds[row["kind"]] = max(seeds[row["kind"]], row["seed"] + 1)
    for _, row in dispatch(options.jobs, _turns(seeds, folder, end)):
        journal.add({f"{row['kind']} {row['seed']}": row})
        text = "".join(f"\n  {wrong}" for wrong in row["wrong"])
        print(f"{row['key']}: {row['cases']} in {row['seconds']} s{text}", flush=True)
        (folder / "soak.html").write_text(page(journal.rows), encoding="utf-8")
    findings = sum(len(row["wrong"]) for row in journal.rows.values())
    print(f"{findings} findings in {len(journal.rows)} tasks: {folder / 'soak.html'}")
    return int(findings > 0)
