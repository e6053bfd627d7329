"""The page on estimators of one's own does what it says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import boresight
from boresight.cli import main

PAGE = Path(__file__).parents[2] / "docs" / "estimators.md"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    blocks = re.findall(r"```(python|csv)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    files = dict(
        zip(
            ("track.py", "log.csv", "cart.py", "facing.py"),
            (text for _, text in blocks),
            strict=True,
        )
    )
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "line",
    [
        "run track.py log.csv --on float",
        "check track.py log.csv --levels fixed,c",
        "compile track.py -o build",
        "accuracy track.py log.csv",
        "tune track.py log.csv -o track.json",
        "simulate cart.py:Cart track.py:Track --on c --against fixed --steps 100",
    ],
)
def test_commands(line, folder, capsys):
    assert main([*line.split(), "--quiet"]) == 0
    assert not capsys.readouterr().err


def test_every_verb_of_the_page_is_there(capsys):
    for verb in set(re.findall(r"^boresight (\w+)", PAGE.read_text(encoding="utf-8"), re.M)):
        with pytest.raises(SystemExit) as done:
            main([verb, "--help"])
        assert done.value.code == 0


def test_the_outputs_are_a_log(folder):
    found = boresight.run("track.py:Track", "log.csv", on="fixed", output="out.csv")
    again = boresight.record_of("out.csv")
    assert again.columns["pos"].unit == "m"
    assert again.columns["pos"].values.tolist() == found["outputs"]["pos"].tolist()
    assert [d["output"] for d in found["truth"]] == ["pos"]
    # the empty field: the position goes on as it was
    assert found["outputs"]["vel"][2] == found["outputs"]["vel"][1]
