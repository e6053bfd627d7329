"""A seeded sample of mutants over several workers; what is done is kept."""

from __future__ import annotations

import hashlib
import json
import random
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.mutants.edits import Mutant
from tests.mutants.groups import Group, all_mutants, nearest_tests, wider_tests
from tests.mutants.trial import Verdict, run_tests, try_mutant


@dataclass(frozen=True)
class Done:
    """A mutant of a group and its verdict."""

    group: str
    mutant: Mutant
    verdict: Verdict


def sample(
    root: Path, name: str, group: Group, seed: int, count: int, only: str = ""
) -> list[Mutant]:
    """``count`` mutants of a group, or all, in files whose path holds ``only``; the same whatever
    the machine."""
    everything = [m for m in all_mutants(root, group) if only in m.file]
    rng = random.Random(f"{name} {seed}")
    return rng.sample(everything, min(count, len(everything)))


class Record:
    """Verdicts in a file, a line each, so that a run goes on where it was cut off.

    A verdict holds for the code and the tests that it was found with. When only tests have changed,
    what was noticed stays noticed; what survived is tried again.
    """

    def __init__(self, path: Path, root: Path) -> None:
        self.path = path
        self._code = _digest(root, ("boresight", "firmware", "gateware", "model", "sim", "systems"))
        self._tests = _digest(root, ("tests",))
        self._verdicts: dict[str, Verdict] = {}
        if path.exists():
            for line in path.read_text("utf-8").splitlines():
                row = json.loads(line)
                verdict = Verdict(row["verdict"], row["by"])
                self._verdicts.pop(row["key"], None)  # the last word holds
                same = verdict.noticed or row["tests"] == self._tests
                if row["code"] == self._code and same and verdict.verdict != "error":
                    self._verdicts[row["key"]] = verdict

    def find(self, mutant: Mutant) -> Verdict | None:
        """Its verdict, if it still holds."""
        return self._verdicts.get(mutant.key)

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        """Keep a verdict."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        row = {"key": mutant.key, **asdict(verdict), "code": self._code, "tests": self._tests}
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def _digest(root: Path, folders: Sequence[str]) -> str:
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            mutants = path.parent.name == "mutants"  # the instrument itself changes no verdict
            if path.is_file() and "__pycache__" not in path.parts and not mutants:
                digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def run(
    root: Path,
    samples: Mapping[str, Sequence[Mutant]],
    known: Mapping[str, str],
    record: Record,
    *,
    jobs: int,
    limit_s: float,
    cache: Path,
    say: Callable[[str], None],
    witness: Callable[[Path, str], list[str]] | None = None,
) -> list[Done]:
    """Verdicts in the order of the samples; mutants that are ``known`` to be equivalent are left
    out. By the tests of each file, or by what one ``witness`` runs for it."""
    wanted = [(g, m) for g, drawn in samples.items() for m in drawn if m.key not in known]
    verdicts = {m.key: v for _, m in wanted if (v := record.find(m)) is not None}
    open_ones = [m for _, m in wanted if m.key not in verdicts]
    if verdicts:
        say(f"{len(verdicts)} of {len(wanted)} known from before")
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {
            pool.submit(
                try_mutant,
                root,
                m,
                witness(root, m.file) if witness else nearest_tests(root, m.file),
                [] if witness else wider_tests(root, m.file),
                limit_s=limit_s,
                cache=cache,
            ): m
            for m in open_ones
        }
        try:
            for future in as_completed(waiting):
                mutant, verdict = waiting[future], future.result()
                verdicts[mutant.key] = verdict
                record.add(mutant, verdict)
                where = f"{mutant.file}:{mutant.line} {mutant.kind}"
                say(f"{len(verdicts)}/{len(wanted)} {verdict.verdict:8s} {where} {verdict.by}")
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return [Done(group, m, verdicts[m.key]) for group, m in wanted]


def unsound(root: Path, done: Sequence[Done], *, limit_s: float, cache: Path) -> str:
    """The tests that noticed a mutant must pass without one; the first that does not, or nothing.

    A test that fails anyway would count every mutant as noticed.
    """
    tests = sorted({d.verdict.by for d in done if d.verdict.verdict in ("nearest", "wider")})
    if not tests:
        return ""
    code, by = run_tests(root, [*tests, "-m", ""], limit_s, cache)  # the search is no daily test
    return "" if code == 0 else by
