"""Whatever is typed, and whatever the files hold: a result, or one clear line and exit code 2.

Every verb is real up to where its work would begin to take long (`SEAMS`); there a run counts as
understood. `run` and `check` on the quick levels, `monitor`, `replay` and all readers of files are
real to the end.
"""

from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from boresight.cli import main
from boresight.model.estimator import Estimator
from boresight.model.words.program import Program
from boresight.sim.attitude.ma2014.experiment import Ma2014
from tests.support.command_lines import FILES, command_lines

EVERYDAY = settings(
    settings.get_profile("everyday"), max_examples=120, suppress_health_check=list(HealthCheck)
)
SOAK = settings(EVERYDAY, max_examples=10_000, derandomize=False, print_blob=True)


class Reached(BaseException):
    """The command line was understood: its work would begin now."""


def begin(*_: object, **__: object) -> Any:
    """Stands where the work begins."""
    raise Reached


#: Where the work of the verbs begins, besides `Estimator.compile_traced`.
SEAMS = (
    "boresight.sim.levels.integer.CModel",
    "boresight.sim.levels.build.build_shared_core",
    "boresight.verbs.figures.accuracy.benchmark",
    "boresight.verbs.figures.covariance.covariance_trial",
    "boresight.verbs.figures.covariance.hostile",
    "boresight.verbs.demo.bundled",
    "boresight.verbs.doctor.doctor",
)


@pytest.fixture
def understood(monkeypatch):
    """Verbs end in `Reached` where their work begins."""
    for name in SEAMS:
        monkeypatch.setattr(name, begin)
    monkeypatch.setattr(Estimator, "compile_traced", begin)
    monkeypatch.setattr(Ma2014, "run", begin)


@pytest.fixture
def quick(monkeypatch):
    """Programs are compiled once each; what needs a core, or C of its own, counts as understood."""
    traced = functools.cache(Estimator.compile_traced)
    known = functools.cache(lambda of, word: traced(of(), word=word))

    def trace_once(self: Estimator, *, word: int = 32) -> tuple[Program, Any]:
        return known(type(self), word if word in (18, 32) else 32)

    monkeypatch.setattr(Estimator, "compile_traced", trace_once)
    monkeypatch.setattr("boresight.sim.levels.build.build_shared_core", begin)


def snapshot(folder: Path) -> dict[str, object]:
    """Everything below a folder, with the contents of files."""
    return {
        str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None
        for p in sorted(folder.rglob("*"))
    }


def judge(argv: list[str], files: dict[str, bytes]) -> str:
    """Run a command line in a folder with these files; say how it ended, or fail."""
    home = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="battery-") as name:
        folder = Path(name)
        (folder / "folder").mkdir()
        (folder / "loop").symlink_to("loop")
        (folder / "gone").symlink_to("nowhere")
        for file, content in files.items():
            (folder / file).write_bytes(content)
        before = snapshot(folder)
        out, err = io.StringIO(), io.StringIO()
        os.chdir(folder)
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                code = main(argv)
        except SystemExit as stop:
            code = int(stop.code or 0)
        except Reached:
            return "understood"
        finally:
            os.chdir(home)
        text, line = out.getvalue(), err.getvalue()
        assert code in (0, 1, 2), (code, line)
        if code == 2:
            assert line.startswith("error: ") and line.endswith("\n"), line[:500]
            assert line[:-1].isprintable() and len(line) < 400, ascii(line[:500])
            assert snapshot(folder) == before, sorted(set(snapshot(folder)) - set(before))
            if text and argv[0] != "monitor":  # the error as an object
                assert "--json" in argv and json.loads(text).keys() == {"error"}, text
            return "refused"
        assert text.strip() or "Traceback" not in line and line, "nothing said"
        if "--json" in argv and "--help" not in argv and "-h" not in argv and code == 0:
            json.loads(text)
        return "done"


def used(argv: list[str]) -> st.SearchStrategy[dict[str, bytes]]:
    """Contents of the files that a command line names."""
    named = {f: s for f, s in FILES.items() if any(f in word for word in argv)}
    return st.fixed_dictionaries(named)


LINES = command_lines().flatmap(lambda argv: st.tuples(st.just(argv), used(argv)))
#: Those that have no work to do are drawn often enough whatever other verbs there are.
IDLE = command_lines("list").flatmap(lambda argv: st.tuples(st.just(argv), used(argv)))
REAL = command_lines("run", "check", "monitor", "list").flatmap(
    lambda argv: st.tuples(st.just(argv), used(argv))
)


def ends(cases: st.SearchStrategy[Any], how: settings) -> Counter[str]:
    """Run the cases; count how they ended."""
    results: Counter[str] = Counter()

    @how
    @given(cases)
    def run(case: tuple[list[str], dict[str, bytes]]) -> None:
        results[judge(*case)] += 1

    run()
    return results


def test_any_command_line(understood):
    result = ends(st.one_of(LINES, LINES, LINES, IDLE), EVERYDAY)
    # Done is only what has no work: lists, help, and what `new` writes.
    assert min(result["refused"], result["understood"]) >= 5 and result["done"] >= 3, result


def test_real_runs(quick):
    result = ends(REAL, settings(EVERYDAY, max_examples=100))
    assert min(result[end] for end in ("done", "refused")) >= 3, result


@pytest.mark.soak
def test_ten_thousand_command_lines(understood):
    result = ends(LINES, SOAK)
    assert min(result[end] for end in ("done", "refused", "understood")) >= 300, result


@pytest.mark.soak
def test_two_thousand_real_runs(quick):
    result = ends(REAL, settings(SOAK, max_examples=1200))
    assert min(result[end] for end in ("done", "refused")) >= 100, result
