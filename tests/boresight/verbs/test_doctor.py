"""`boresight doctor`: where the build cache is, how full, and how it is emptied."""

from __future__ import annotations

import json

import pytest

from boresight.cli import main
from boresight.model.tools.cache import Cache
from boresight.model.tools.needs import install_line


@pytest.fixture
def cache(tmp_path, monkeypatch):
    # Not by XDG_CACHE_HOME: Yosys would translate itself anew there.
    monkeypatch.setattr("boresight.model.tools.cache.cache_folder", lambda name: tmp_path / name)
    result = Cache()
    result.get("n", "i", lambda folder: (folder / "data").write_bytes(bytes(1_500_000)) and None)
    return result


def test_shows_the_cache(cache, capsys):
    main(["doctor"])
    line = capsys.readouterr().out.splitlines()[-1]
    assert line.startswith(f"{'build cache':24s} {cache.root}: 1 entries, 1.5 MB ")
    assert "--clear-cache" in line
    main(["doctor", "--json"])
    shown = json.loads(capsys.readouterr().out)["cache"]
    assert (shown["path"], shown["entries"]) == (str(cache.root), 1)


def test_empties_the_cache(cache, capsys):
    cache.root.joinpath("mine").write_text("user")
    assert main(["doctor", "--clear-cache"]) == 0
    text = f"1 entries, 1.5 MB removed from the cache in {cache.root}\n"
    assert capsys.readouterr().out == text
    assert {p.name for p in cache.root.iterdir()} == {"locks", "mine"}
    assert main(["doctor", "--clear-cache", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "path": str(cache.root),
        "entries": 0,
        "bytes": 0,
    }


def test_all_tools_are_here(capsys):
    assert main(["doctor", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["good"] is True


def test_tells_optional_from_needed(cache, capsys, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name, **_: None)
    monkeypatch.setattr("boresight.verbs.doctor.available", lambda name: name == "verilator")
    assert main(["doctor"]) == 1
    lines = {line[:24].strip(): line[25:] for line in capsys.readouterr().out.splitlines()}
    assert lines["gcc"] == f"MISSING: {install_line('gcc')}"
    assert lines["iverilog"] == (
        f"not here: {install_line('iverilog')} (optional: a second simulator in `boresight check`)"
    )
    assert lines["ISE (xst)"].startswith("not here: ISE 14.7 (optional: bitstreams")
    assert lines["numpy"][0].isdigit() and lines["scipy"].endswith(
        "(optional: MAT; `boresight convert`)"
    )
    assert main(["doctor", "-q"]) == 1
    assert {line.split()[1] for line in capsys.readouterr().out.splitlines()} == {"MISSING:"}


def test_packages_are_those_of_the_metadata(cache, capsys):
    main(["doctor", "--json"])
    tools = {t["tool"]: t for t in json.loads(capsys.readouterr().out)["tools"]}
    assert {"numpy", "mpmath", "amaranth", "pint"} <= set(tools)
    assert not {"pytest", "sphinx", "distributed"} & set(tools)
    assert not tools["vqf"]["needed"] and not tools["libpython"]["needed"]
    assert all(t["needed"] != bool(t["use"]) for t in tools.values())
