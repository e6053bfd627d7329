"""`--baseline` and `--junit` of real results: what a change of a filter costs fails a test."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

import boresight
from boresight.cli import main
from boresight.model.errors import InputError
from tests.support.pages import user_folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A new estimator with its results, as --json prints them."""
    path = tmp_path_factory.mktemp("mine")
    with pytest.MonkeyPatch.context() as patch, user_folder(path, patch):
        boresight.new("mine")
        for verb, line in LINES.items():
            Path(f"{verb}.json").write_text(json.dumps(_result(line)))
        yield path


LINES = {
    "check": "check mine.py mine.csv --levels fixed,c",
    "compile": "compile mine.py -o build",
    "accuracy": "accuracy mine.py mine.csv",
}


def _result(line: str) -> object:
    verb, *words = line.split()
    options = dict(zip(words[-2:-1], words[-1:], strict=True)) if words[-2][0] == "-" else {}
    files = words[:-2] if options else words
    results = {
        "check": lambda: boresight.check(*files, levels=("fixed", "c")),
        "compile": lambda: boresight.compile(*files, output="build"),
        "accuracy": lambda: boresight.accuracy(*files),
    }
    return results[verb]().to_json()


#: A product more: cycles. A wider state: errors. Another gain: errors of the truth.
CHANGES = {
    "compile": (
        "ahead + p.alpha * innovation",
        "ahead + p.alpha * innovation * (1.0 + 0.001 * innovation)",
    ),
    "check": ('State("pos", -128.0, 128.0', 'State("pos", -4096.0, 4096.0'),
    "accuracy": ('"alpha", 0.3', '"alpha", 0.8'),
}


@pytest.mark.parametrize("verb", LINES)
def test_a_worse_filter_fails(verb, folder, capsys):
    line = [*LINES[verb].split(), "-q", "--baseline", f"{verb}.json"]
    assert main(line) == 0
    assert "figures equal, 0 changed" in capsys.readouterr().out.splitlines()[-1]
    source = Path("mine.py").read_text()
    old, new = CHANGES[verb]
    assert old in source
    Path("mine.py").write_text(source.replace(old, new))
    try:
        assert main([*line, "--junit", "junit.xml"]) == 1
        said = capsys.readouterr().out
        assert said.splitlines()[-1].startswith(f"FAILED: worse than {verb}.json: ")
        assert "\ngood\n" not in said
        suite = ElementTree.parse("junit.xml").getroot()
        names = {case.get("name") for case in suite if len(case)}
        assert suite.get("failures") == str(len([case for case in suite if len(case)]))
        title = {"compile": "latency", "check": "largest error", "accuracy": "against truth"}[verb]
        assert any(title in name for name in names), names
        assert main([*line, "--json", "--allow", "cycles=9", "--allow", "error=999"]) == 0
        assert json.loads(capsys.readouterr().out)["baseline"]["changes"]
    finally:
        Path("mine.py").write_text(source)


def test_in_python(folder):
    result = boresight.check("mine.py", "mine.csv", levels=("fixed", "c"))
    assert boresight.baseline(result, "check.json").good
    with pytest.raises(InputError, match="a result of check, compile or accuracy"):
        boresight.baseline(boresight.list_estimators(), "check.json")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("check mine.py mine.csv --baseline nosuch.json", "nosuch.json: wanted an earlier result"),
        ("check mine.py mine.csv --baseline compile.json", "result, which --json prints for the "),
        ("check mine.py mine.csv --word 28 --baseline check.json", "result of the same mine, mine"),
        ("check mine.py mine.csv --allow area=1", "--allow: wanted --baseline with it"),
        ("check mine.py mine.csv --baseline check.json --allow x=1", "allow x: wanted a share"),
        ("check mine.py mine.csv --junit mine.csv", "an output that is not an input"),
        ("run mine.py mine.csv --baseline check.json", "found --baseline check.json; "),
    ],
)
def test_mistakes(line, said, folder, capsys):
    before = sorted(folder.iterdir())
    try:
        code = main([*line.split(), "-q"])
    except SystemExit as end:
        code = end.code
    heard = capsys.readouterr()
    assert code == 2 and said in heard.err and heard.err.count("\n") == 1, heard
    assert sorted(folder.iterdir()) == before
