"""The files beside a core: each is taken by the tool that it is for, and the bench bites."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tree_sitter
import tree_sitter_vhdl
from amaranth.back import rtlil

from boresight.core_files import core_files
from boresight.gateware.bus.axi_core import axi_ports
from boresight.gateware.description import core_pins, describe
from boresight.gateware.engine.engine import word_layout
from boresight.gateware.texts.core import integration_files, integration_names
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.rtl.simulators import available

Design = tuple[Path, Build]
Bench = Callable[..., tuple[int, str]]
ICARUS = pytest.mark.skipif(
    not available("icarus"), reason="Icarus Verilog: apt-get install iverilog"
)
#: As of `tests/gateware/test_plain_verilog.py`, which runs more of the core in all of them.
MODES = ["2001", "2005", "2005-sv", "2009", "2012"]
MODULES = {
    "core": [(pin.direction, pin.name, pin.bits) for pin in core_pins(32)],
    "core_axi": list(axi_ports()),
}


def test_ports_of_the_core_behind_axi(one: Design) -> None:
    text = (one[0] / "core_axi.v").read_text()
    module = text[text.index("\nmodule core_axi(") :].partition("endmodule")[0]
    matches = re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\w+);$", module, re.M)
    assert {(side, name, int(high or 0) + 1) for side, high, name in matches} == set(axi_ports())
    assert [name for _, name, _ in axi_ports()][:3] == ["aclk", "aresetn", "s_axis_tdata"]
    assert "always @*" not in text and len(re.findall(r"^  core core \(", text, re.M)) == 1


def test_names(one: Design, linked: Design) -> None:
    for (folder, build), target in ((one, "xc6slx9"), (linked, "generic")):
        files = (p for p in folder.rglob("*") if p.is_file() and p.suffix != ".pyc")
        results = {p.relative_to(folder).as_posix() for p in files}
        names = [e.name for e in build.estimators]
        assert results | {"report.json"} == set(core_files(names, target=target, axi=True))
    without = set(integration_names(axi=True)) - set(integration_names(axi=False))
    assert without == {
        *("core_axi.v", "tb/tb_axi.v"),
        *("integration/core_axi_instance.v", "integration/core_axi_instance.vhd"),
    }


def test_the_flag_of_the_last_update_is_compared(one: Design) -> None:
    build = one[1]
    (run,) = recorded(build)
    for saturated in (False, True):
        runs = [replace(run, saturated=np.full(60, saturated))]
        texts = integration_files(describe(build.core), runs, generic=False, axi=False)
        assert f"        feed(240, 180, {int(saturated)});\n" in texts["tb/tb.v"]
        assert set(texts) == set(integration_names(axi=False))


@ICARUS
@pytest.mark.parametrize(
    "options", [["MODES=2001 2012"], pytest.param([], marks=pytest.mark.soak)], ids=["two", "all"]
)
def test_one_command_in_every_mode(options: list[str], one: Design, tmp_path: Path) -> None:
    folder = tmp_path / "with blanks"
    shutil.copytree(one[0], folder)
    before = {p.name for p in (folder / "tb").iterdir()}
    done = subprocess.run(
        ["make", "-C", "tb", *options], cwd=folder, capture_output=True, text=True
    )
    passed = re.findall(r"^(\S+) +PASS (\w+): 72 words of 24 records$", done.stdout, re.M)
    modes = options[0][6:].split() if options else MODES
    assert done.returncode == 0, done.stdout + done.stderr
    assert passed == [(mode, module) for module in MODULES for mode in modes]
    assert {p.name for p in (folder / "tb").iterdir()} == before
    assert f"\nMODES    ?= {' '.join(MODES)}\n" in (folder / "tb" / "Makefile").read_text()


@ICARUS
def test_the_command_fails_with_the_bench(one: Design, tmp_path: Path) -> None:
    folder = tmp_path / "one"
    shutil.copytree(one[0], folder)
    lines = (folder / "tb" / "expected.hex").read_text().splitlines()
    lines[-1] = lines[-1][:-1] + ("0" if lines[-1][-1] != "0" else "1")
    (folder / "tb" / "expected.hex").write_text("\n".join(lines) + "\n")
    done = subprocess.run(["make", "-C", "tb"], cwd=folder, capture_output=True, text=True)
    assert done.returncode != 0
    assert re.search("^2001 .*\noutput word 71: |FAIL core: 1 words wrong", done.stdout, re.M)
    assert "2005" not in done.stdout  # it ends with the first failure


@ICARUS
@pytest.mark.parametrize("name", ["tb", "tb_axi"])
def test_programs_that_are_linked(name: str, linked: Design, bench: Bench) -> None:
    code, said = bench(linked[0], name, mode="2012")
    assert code == 0 and re.search(r"PASS \w+: 96 words of 48 records", said), said


def spoilt(text: str, module: str, faults: Sequence[tuple[str, str]]) -> str:
    """The module's text behind another that, told ``+fault=K``, spoils an output.

    In the value of a fault ``it`` is what the module itself gives, ``at`` the cycle.
    """
    inner = re.sub(rf"(?m)^module {module}\(", f"module {module}_own(", text)
    ports, clock = MODULES[module], MODULES[module][0][1]
    lines = [f"module {module}({', '.join(name for _, name, _ in ports)});"]
    lines += [f"  {side} [{bits - 1}:0] {name};" for side, name, bits in ports]
    lines += ["  integer fault = -1;", '  initial if ($value$plusargs("fault=%d", fault)) ;']
    lines += ["  reg [15:0] at = 0;", f"  always @(posedge {clock}) at <= at + 1;"]
    for side, name, bits in ports:
        if side == "output":
            values = [
                f"fault == {k} ? ({re.sub('it', f'own_{name}', value)}) : "
                for k, (port, value) in enumerate(faults)
                if port == name
            ]
            lines.append(f"  wire [{bits - 1}:0] own_{name};")
            lines.append(f"  assign {name} = {''.join(values)}own_{name};")
    wires = [f".{n}({'own_' if side == 'output' else ''}{n})" for side, n, _ in ports]
    return "\n".join([inner, *lines, f"  {module}_own own({', '.join(wires)});", "endmodule", ""])


@ICARUS
def test_a_spoilt_core_fails(one: Design, bench: Bench) -> None:
    folder, _ = one
    faults = [
        (
            "o__payload",
            "it ^ (at < 40)",
            "FAIL core: 3 words wrong, 0 untimely, 0 flags wrong, 0 c",
        ),
        ("o__payload", "{at[9] ^ it[32], it[31:0]}", "words wrong"),
        ("o__payload", "at < 40 ? 33'bx : it", "FAIL core: 3 words wrong, 0 untimely, 0 flags"),
        ("o__valid", "it & ~at[8]", "nothing happens after input word"),
        ("saturated_update", "~it", "FAIL core: 0 words wrong, 0 untimely, 24 flags"),
        ("bus__r_data", "it | 2 * (at > 99)", "status register 011"),
        ("bus__r_data", "it == 24 ? 25 : it", "25 updates were counted, wanted 24"),
        ("bus__r_data", "it == 0 ? 24 : it", "24 updates are counted after a reset"),
        ("i__ready", "at == 90 ? 1'bx : it", "1 cycles unknown"),
    ]
    text = (folder / "core_sim.v").read_text()
    core = spoilt(text, "core", [(port, value) for port, value, _ in faults])
    assert bench(folder, core=core)[0] == 0
    for k, (port, value, wanted) in enumerate(faults):
        code, said = bench(folder, again=f"+fault={k}")
        assert code == 1 and wanted in said, (port, value, said)


@ICARUS
def test_a_spoilt_axi_core_fails(linked: Design, bench: Bench) -> None:
    folder, build = linked
    identifier = describe(build.core).build[1]
    faults = [
        ("m_axis_tdata", "{1'b1, it[30:0]}", "words wrong"),
        ("m_axis_tlast", "it | (at < 60)", "words wrong"),
        ("s_axi_bresp", "2'b10", "was answered with 10"),
        ("s_axi_rdata", f"it == {identifier} ? 0 : it", "build identifier 00000000, wanted 000"),
        ("s_axi_bvalid", "0", "nothing happens after input word"),
        ("s_axi_rdata", "it == 48 ? 47 : it", "47 updates were counted, wanted 48"),
    ]
    text = (folder / "core_axi.v").read_text()
    axi = spoilt(text, "core_axi", [(port, value) for port, value, _ in faults])
    assert bench(folder, "tb_axi", axi=axi)[0] == 0
    for k, (port, value, wanted) in enumerate(faults):
        code, said = bench(folder, "tb_axi", again=f"+fault={k}")
        assert code == 1 and wanted in said, (port, value, said)


@ICARUS
def test_a_core_that_is_late_fails(one: Design, bench: Bench) -> None:
    """Every output word waits for a cycle, with all of the core."""
    folder, _ = one
    slow = spoilt((folder / "core_sim.v").read_text(), "core", [("o__valid", "it & hold")])
    holds = "  reg hold = 0;\n  always @(posedge clk) hold <= own_o__valid & ~(hold & o__ready);"
    slow = slow.replace("  reg [15:0] at = 0;", f"  reg [15:0] at = 0;\n{holds}")
    slow = slow.replace(".o__ready(o__ready)", ".o__ready(o__ready & (fault < 0 | hold))")
    assert bench(folder, core=slow)[0] == 0
    code, said = bench(folder, again="+fault=0")
    assert code == 1 and "FAIL core: 0 words wrong" in said
    assert re.search(r"output word 0: cycle (\d+), wanted (?!\1)", said)
    assert re.search(r"input word 4: \d+ cycles since the record before", said)


@ICARUS
def test_another_word_in_a_memory_fails(one: Design, bench: Bench) -> None:
    """The same words and cycles, with another default of the parameter."""
    folder, build = one
    (gain,) = (v.initial for v in build.programs[0].values if v.name == "gain")
    text = (folder / "core_sim.v").read_text()
    changed = re.sub(rf"= 32'd{gain};", f"= 32'd{gain + 1000};", text)
    assert changed != text
    code, said = bench(folder, core=changed)
    assert code == 1 and re.search(r"FAIL core: [1-9]\d+ words wrong, 0 untimely", said), said


@ICARUS
def test_the_bench_needs_its_words(one: Design, bench: Bench, tmp_path: Path) -> None:
    code, said = bench(one[0], words=tmp_path)
    assert code == 1 and "FAIL" in said


# -- instances ------------------------------------------------------------------------------------


@ICARUS
@pytest.mark.parametrize("module", MODULES)
def test_verilog_instance(module: str, one: Design) -> None:
    folder, _ = one
    path = folder / "integration" / f"{module}_instance.v"
    text = path.read_text()
    assert set(re.findall(r"^        \.(\w+)\(\1\),?$", text, re.M)) == {
        name for _, name, _ in MODULES[module]
    }
    sources = [path, folder / "core_sim.v", folder / "core_axi.v"]
    done = subprocess.run(
        ["iverilog", "-g2001", "-Wall", "-Wno-timescale", "-tnull", "-s", path.stem, *sources],
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.returncode and path.name not in done.stderr, done.stderr


PAYLOADS = """
module core(%s);
%s
    assign o__payload = {1'b1, 32'd7};
endmodule

module check;
    core_instance dut (.clk(1'b0), .rst(1'b0));
    initial begin
        force dut.in_word = 5;
        force dut.in_last = 1;
        #1 $display("%%h %%b %%0d", dut.i__payload, dut.out_last, dut.out_word);
    end
endmodule
"""


@ICARUS
def test_the_mark_stands_above_the_word(one: Design, tmp_path: Path) -> None:
    """In Verilog; the other languages' tests say so of theirs."""
    ports = MODULES["core"]
    heads = "\n".join(f"    {side} [{bits - 1}:0] {name};" for side, name, bits in ports)
    names = ", ".join(name for _, name, _ in ports)
    (tmp_path / "check.v").write_text(PAYLOADS % (names, heads))
    built, instance = tmp_path / "check", one[0] / "integration" / "core_instance.v"
    command = ["iverilog", "-g2001", "-s", "check", "-o", built, instance, tmp_path / "check.v"]
    subprocess.run(command, check=True)
    said = subprocess.run(["vvp", "-n", built], capture_output=True, text=True, check=True).stdout
    assert said == "100000005 1 7\n"


@pytest.mark.parametrize("module", MODULES)
def test_vhdl_instance(module: str, one: Design, tmp_path: Path) -> None:
    """It is VHDL, and component and port map have the ports of the module."""
    folder, _ = one
    path = folder / "integration" / f"{module}_instance.vhd"
    text = path.read_text()
    language = tree_sitter.Language(tree_sitter_vhdl.language())
    for good, source in ((True, text), (False, text.replace("port map", "port mapp"))):
        tree = tree_sitter.Parser(language).parse(source.encode())
        assert tree.root_node.has_error != good
    component = text[text.index(f"component {module}\n") : text.index("end component")]
    matches = re.findall(
        r"^ +(\\\w+\\|\w+) : (in|out) std_logic(?:_vector\((\d+) downto 0\))?;?$", component, re.M
    )
    assert [
        (f"{side}put", name.strip("\\"), int(high or 0) + 1) for name, side, high in matches
    ] == MODULES[module]
    plain = [name for name, _, _ in matches if not name.startswith("\\")]
    assert not [name for name in plain if "__" in name]
    connected = re.findall(r"^ +(\\\w+\\|\w+) => \w+,?$", text, re.M)
    assert connected == [name for name, _, _ in matches]
    if module == "core":
        assert "  i_payload <= in_last & in_word;\n  out_last <= o_payload(32);\n" in text
        assert "  out_word <= o_payload(31 downto 0);\n" in text
    if shutil.which("ghdl"):
        subprocess.run(["ghdl", "-a", "--std=93", f"--workdir={tmp_path}", path], check=True)


def imported(path: Path) -> Any:
    """A generated Python file as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_amaranth_instance(one: Design) -> None:
    folder, _ = one
    module = imported(folder / "integration" / "core_amaranth.py")

    class Platform:
        files: dict[str, str] = {}

        def add_file(self, name: str, text: str) -> None:
            self.files[name] = text

    assert word_layout(32) == module.PAYLOAD
    platform = Platform()
    text = rtlil.convert(module.Core(), platform=platform)
    assert platform.files == {"core.v": (folder / "core.v").read_text()}
    cell = text[text.index("cell \\core") :]
    connected = re.findall(r"connect \\(\w+) \\(\w+)", cell[: cell.index("\n  end")])
    assert {name for name, _ in connected} == {name for _, name, _ in MODULES["core"]}
    assert all(to == name.replace("bus__", "bus_") for name, to in connected)
    assert rtlil.convert(module.Core(), platform=None)


LITEX = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("core_litex", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
from migen.fhdl import verilog

class Platform:
    def add_source(self, name):
        print("source", name)

for kind, names in ((module.Core, ["bus_addr", "bus_w_data", "bus_w_stb", "bus_w_ack",
                                   "bus_r_data"]), (module.AxiCore, [])):
    core = kind(Platform())
    ports = {getattr(core, name) for name in [*names, "saturated_update"]}
    bus = [] if names else [getattr(core.bus, c) for c in ("aw", "w", "b", "ar", "r")]
    for side in (core.sink, core.source, *bus):
        ports |= set(side.flatten())
    print(verilog.convert(core, ports))
"""


def test_litex_instance(one: Design) -> None:
    folder, _ = one
    path = folder / "integration" / "core_litex.py"
    done = subprocess.run(
        [sys.executable, "-c", LITEX, path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    names = re.findall(r"^source (.*)$", done.stdout, re.M)
    assert names == [str(folder / name) for name in ("core.v", "core.v", "core_axi.v")]
    for module, ports in MODULES.items():
        (instance,) = re.findall(rf"^{module} {module}\w*\(\n(.*?)\n\);", done.stdout, re.M | re.S)
        results = dict(re.findall(r"^\t\.(\w+)\((.*?)\),?$", instance, re.M))
        assert results == {name: litex_name(name) for _, name, _ in ports}


def litex_name(port: str) -> str:
    """What a port is to be connected to, in the Verilog that Migen makes of the LiteX module."""
    known = {"clk": "sys_clk", "aclk": "sys_clk", "rst": "sys_rst", "aresetn": "(~sys_rst)"}
    sides = {"i__": "sink_", "o__": "source_", "s_axis_t": "sink_", "m_axis_t": "source_"}
    for start, side in sides.items():
        if port.startswith(start):
            rest = port.removeprefix(start)
            if rest == "payload":
                return f"{{{side}last, {side}payload_data}}"
            return f"{side}{'payload_data' if rest == 'data' else rest}"
    if match := re.fullmatch(r"s_axi_(aw|w|b|ar|r)(addr|data|strb|resp|valid|ready)", port):
        channel, what = match.groups()
        if what in ("valid", "ready"):
            return f"{channel}_{what}"
        return f"{channel}_payload_{what}" + ("[11:0]" if what == "addr" else "")
    return known.get(port, port.replace("bus__", "bus_"))


XDG = ("CACHE", "CONFIG", "DATA", "STATE")


@ICARUS
def test_fusesoc(linked: Design, tmp_path: Path) -> None:
    """It finds the core, and runs the bench from the folders that it copies."""
    root = tmp_path / "cores"
    shutil.copytree(linked[0], root / "core")
    name = re.search(r"^name: (\S+)$", (root / "core" / "core.core").read_text(), re.M)
    assert name is not None and name[1] == "boresight:core:core-small:0"
    default, bench = (root / "core" / "core.core").read_text().split("targets:")[1].split("  sim:")
    assert "filesets: [core, axi]\n    toplevel: core_axi\n" in default
    assert "filesets: [ axi, bench ]\n    toplevel: tb_axi\n" in bench
    command = [Path(sys.executable).with_name("fusesoc"), "--cores-root", root]
    done = subprocess.run(
        [*command, "run", "--target=sim", name[1]],
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path), **{f"XDG_{n}_HOME": str(tmp_path) for n in XDG}},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "PASS core_axi: 96 words of 48 records" in done.stdout + done.stderr
