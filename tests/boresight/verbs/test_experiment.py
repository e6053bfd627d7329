"""The verb: files, exit codes, progress, one-line errors. The experiment itself is a stand-in."""

from __future__ import annotations

import json

import pytest

import boresight.verbs.experiment  # noqa: F401  (the module, for monkeypatch)
from boresight.cli import main


@pytest.fixture
def stand_in(monkeypatch):
    """An experiment that takes no time; ``good`` may be changed."""
    import sys

    calls = []
    result = {
        "good": True,
        "claims": [{"claim": "C equals", "good": True}],
        "targets": [
            {"good": True, "name": "one", "source": "Table 3", "ours": [0.5, 0.25], "unit": "deg"},
            {"good": False, "name": "two", "source": "Figure 7", "ours": [1.0], "unit": ""},
        ],
    }

    def run(*, seed, runs, progress):
        calls.append((seed, runs))
        if progress is not None:
            progress("half way")
        return result

    module = sys.modules["boresight.verbs.experiment"]
    monkeypatch.setattr(module, "EXPERIMENTS", {"ma2014": (run, lambda data: "<html></html>\n")})
    return result, calls


def test_writes_page_and_json_and_reports_targets(stand_in, tmp_path, capsys):
    out = tmp_path / "new" / "folder"
    assert main(["experiment", "ma2014", "-o", str(out), "--seed", "7"]) == 0
    names = [".boresight.json", "ma2014.html", "ma2014.json"]
    assert sorted(p.name for p in out.iterdir()) == names
    assert json.loads((out / "ma2014.json").read_text()) == stand_in[0]
    assert stand_in[1][0][0] == 7
    text = capsys.readouterr()
    assert "half way" in text.err and "half way" not in text.out
    assert "pass  one (Table 3): 0.5 / 0.25 deg" in text.out
    assert "FAIL  two (Figure 7): 1\n" in text.out
    assert "targets met: 1 of 2" in text.out and str(out / "ma2014.html") in text.out


def test_json_alone_on_stdout(stand_in, tmp_path, capsys):
    assert main(["experiment", "ma2014", "-o", str(tmp_path), "--json"]) == 0
    text = capsys.readouterr()
    assert json.loads(text.out) == stand_in[0] and text.err == ""


def test_quiet(stand_in, tmp_path, capsys):
    assert main(["experiment", "ma2014", "-o", str(tmp_path), "-q"]) == 0
    assert capsys.readouterr().err == ""


def test_a_broken_claim_is_exit_code_1(stand_in, tmp_path, capsys):
    stand_in[0]["good"] = stand_in[0]["claims"][0]["good"] = False
    assert main(["experiment", "ma2014", "-o", str(tmp_path)]) == 1
    assert "FAILED: C equals" in capsys.readouterr().out


def refused(capsys, *argv):
    code = main([str(a) for a in argv])
    out = capsys.readouterr()
    assert code == 2 and out.out == "" and out.err.count("\n") == 1, out
    assert out.err.startswith("error: ")
    return out.err


def test_bad_names_seeds_and_folders(tmp_path, capsys):
    assert "wanted one of ma2014, found 'ma2015'" in refused(capsys, "experiment", "ma2015")
    assert "seed" in refused(capsys, "experiment", "ma2014", "--seed", "-1", "-o", tmp_path)
    assert not list(tmp_path.iterdir())
    blocker = tmp_path / "file"
    blocker.write_text("")
    assert "file" in refused(capsys, "experiment", "ma2014", "-o", blocker)
    assert blocker.read_text() == ""
