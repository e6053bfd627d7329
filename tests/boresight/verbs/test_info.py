"""`boresight info`: tools, declarations, columns, topics."""

from __future__ import annotations

from pathlib import Path

from boresight.verbs import info as module


def test_tools_and_names(data) -> None:
    found = data("info")
    tools = {tool["tool"]: tool for tool in found["tools"]}
    assert found["good"] and {"gcc", "yosys", "verilator", "numpy"} <= {*tools}
    assert "battery" in found["estimators"] and "small" in found["machines"]


def test_a_missing_tool_fails_with_the_line_that_installs_it(monkeypatch, said) -> None:
    import sys

    monkeypatch.setattr(sys.modules["boresight.verbs.info"], "_PROGRAMS", ("nosuchtool",))
    last = said("info", 1).splitlines()[-1]
    assert last == "FAILED: nosuchtool is missing: sudo apt-get install build-essential"


def test_an_estimator_and_a_table(here: Path, data, said, refused) -> None:
    found = data("info mine.py")
    assert [p["parameter"] for p in found["parameters"]] == ["alpha", "beta"]
    assert "share of the innovation" in said("info mine.py")
    found = data("info mine.csv")
    (z,) = [c for c in found["columns"] if c["column"] == "z"]
    assert found["rows"] == 400 and z["unit"] == "m" and z["values"] == 360
    assert "wanted" in refused("info nosuch.csv")
    assert module is not None
