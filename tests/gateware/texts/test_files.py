"""The files beside a core: each is taken by the tool that it is for, and the bench finds faults."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.gateware.bus.axi import axi_ports
from boresight.gateware.description import Word, core_pins, describe
from boresight.gateware.texts.core import _example
from boresight.sim.levels.build import Build
from boresight.sim.rtl.simulators import available
from boresight.verbs.compile import core_files

Design = tuple[Path, Build]
ICARUS = pytest.mark.skipif(not available("icarus"), reason="Icarus: apt-get install iverilog")
#: The one with the fewest features, and the one with the most reserved words.
MODES = ["2001", "2012"]
#: Module -> direction, name and bits of its ports.
MODULES = {
    "core": [(pin.direction, pin.name, pin.bits) for pin in core_pins(32)],
    "core_axi": list(axi_ports()),
}


def test_names(one: Design, several: Design) -> None:
    """What is written is what was announced, and the README names only what is there."""
    for (folder, build), target in ((one, "xc6slx9"), (several, "generic")):
        results = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
        names = [e.name for e in build.estimators]
        assert results | {"report.json"} == set(core_files(names, target))
        text = (folder / "README.md").read_text()
        named = re.findall(r"`([\w/]+\.(?:v|h|core|json|vhd))`", text)
        assert len(named) > 6 and {n for n in named if not (folder / n).exists()} == {"report.json"}


def test_verilog_has_primitives_only_for_the_part_that_has_them(
    one: Design, several: Design
) -> None:
    own, generic = ((folder / "core.v").read_text() for folder, _ in (one, several))
    kinds = set(re.findall(r"(?m)^  (LUT\d|DSP48A1) #\(", own))
    described = set(re.findall(r"(?m)^module (\w+) ", (one[0] / "spartan6.v").read_text()))
    assert {"LUT6", "DSP48A1"} <= kinds <= described
    assert not re.search(r"LUT\d|DSP48A1", generic)


@pytest.mark.parametrize("module", MODULES)
def test_ports(module: str, one: Design) -> None:
    """Of the Verilog, of its head, and of both instances."""
    folder = one[0]
    text = (folder / f"{module}.v").read_text()
    body = text[text.index(f"\nmodule {module}(") :].partition("endmodule")[0]
    ports = re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\w+);$", body, re.M)
    assert {(side, name, int(high or 0) + 1) for side, high, name in ports} == {*MODULES[module]}
    vhdl = (folder / "integration" / f"{module}_instance.vhd").read_text()
    component = vhdl[vhdl.index(f"component {module}\n") : vhdl.index("end component")]
    matches = re.findall(
        r"^ +(\\\w+\\|\w+) : (in|out) std_logic(?:_vector\((\d+) downto 0\))?;?$", component, re.M
    )
    assert [
        (f"{side}put", name.strip("\\"), int(high or 0) + 1) for name, side, high in matches
    ] == MODULES[module]
    connected = re.findall(r"^ +(\\\w+\\|\w+) => \w+,?$", vhdl, re.M)
    assert connected == [name for name, _, _ in matches]
    assert not [n for n in connected if "__" in n and not n.startswith("\\")]
    if shutil.which("ghdl"):
        command = ["ghdl", "-a", "--std=93", f"--workdir={folder}"]
        subprocess.run([*command, f"integration/{module}_instance.vhd"], cwd=folder, check=True)


@ICARUS
@pytest.mark.parametrize("module", MODULES)
def test_verilog_instance(module: str, one: Design) -> None:
    folder = one[0]
    path = folder / "integration" / f"{module}_instance.v"
    connected = re.findall(r"^        \.(\w+)\(\1\),?$", path.read_text(), re.M)
    assert set(connected) == {name for _, name, _ in MODULES[module]}
    sources = [path, *(folder / name for name in ("core.v", "spartan6.v", "core_axi.v"))]
    done = subprocess.run(
        ["iverilog", "-g2001", "-Wall", "-Wno-timescale", "-tnull", "-s", path.stem, *sources],
        capture_output=True,
        text=True,
    )
    assert not done.returncode and path.name not in done.stderr, done.stderr


@ICARUS
@pytest.mark.parametrize("kind", ["one", "several"])
def test_one_command_runs_the_bench_in_every_mode(
    kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    folder = tmp_path / "with blanks"
    shutil.copytree(request.getfixturevalue(kind)[0], folder)
    modes = MODES if kind == "one" else MODES[-1:]
    done = subprocess.run(
        ["make", "-C", "tb", f"MODES={' '.join(modes)}"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    words = 72 if kind == "one" else 72 + 48
    passed = re.findall(rf"^(\S+) +PASS (\w+): {words} words of ", done.stdout, re.M)
    assert passed == [(mode, module) for module in MODULES for mode in modes]


#: A port of a module, its value in terms of the true one (``it``) and of words or cycles so far
#: (``at``), and what the bench then says.
FAULTS = {
    "core": [
        (
            "o__payload",
            "it ^ (at < 40)",
            "FAIL core: 3 words wrong, 0 untimely, 0 flags wrong, 0 c",
        ),
        ("o__payload", "{at[9] ^ it[32], it[31:0]}", "words wrong"),
        ("o__payload", "at < 40 ? 33'bx : it", "FAIL core: 3 words wrong, 0 untimely, 0 flags"),
        ("o__valid", "it & ~at[8]", "nothing happens after input word"),
        ("saturated_update", "~it", "FAIL core: 0 words wrong, 0 untimely, 29 flags"),
        ("beyond_update", "1'b0", "FAIL core: 0 words wrong, 0 untimely, 1 flags"),
        ("bus__r_data", "it & ~16", "FAIL core: 0 words wrong, 0 untimely, "),
        ("bus__r_data", "it == 24 ? 25 : it", "25 updates were counted, wanted 24"),
        ("i__ready", "at == 90 ? 1'bx : it", "1 cycles unknown"),
        ("bus__r_data", "at == 90 ? {31'b0, 1'bx} : it", "1 cycles unknown"),
        ("restart", "1'b0", "FAIL core: 2 words wrong, 0 untimely, 0 flags"),
        ("rst", "it & at < 9", "words wrong"),
    ],
    "core_axi": [
        ("m_axis_tdata", "{1'b1, it[30:0]}", "words wrong"),
        ("m_axis_tlast", "it | (at < 60)", "words wrong"),
        ("s_axi_rdata", "it == 24 ? 23 : it", "23 updates were counted, wanted 24"),
        ("s_axi_awaddr", "it == 2068 ? 2064 : it", "FAIL core_axi: 2 words wrong"),
    ],
}


def spoilt(text: str, module: str) -> str:
    """A module around another one, which changes one port: that which ``+fault=`` says."""
    ports, clock = MODULES[module], "aclk" if module == "core_axi" else "clk"
    inner = re.sub(rf"(?m)^module {module}\(", f"module {module}_own(", text)
    lines = [f"module {module}({', '.join(name for _, name, _ in ports)});"]
    for side, name, bits in ports:
        lines.append(f"  {side} [{bits - 1}:0] {name};")
        lines.append(f"  wire [{bits - 1}:0] own_{name};")
    lines.append("  reg [15:0] at = -20; integer fault = -1;  // 20 cycles without a reset")
    lines.append('  initial if (!$value$plusargs("fault=%d", fault)) fault = -1;')
    lines.append(f"  always @(posedge {clock}) at <= at + 1;")
    for side, name, _ in ports:
        true, shown = (f"own_{name}", name) if side == "output" else (name, f"own_{name}")
        value = true
        for k, (port, changed, _) in enumerate(FAULTS[module]):
            if port == name:
                wrong = changed.replace("it", true)
                value = f"fault == {k} ? ({wrong}) : {value}"
        lines.append(f"  assign {shown} = {value};")
    wires = [f".{name}(own_{name})" for _, name, _ in ports]
    return "\n".join([inner, *lines, f"  {module}_own own({', '.join(wires)});", "endmodule", ""])


@ICARUS
@pytest.mark.parametrize(("module", "bench"), [("core", "tb"), ("core_axi", "tb_axi")])
def test_the_bench_finds_faults(module: str, bench: str, one: Design, tmp_path: Path) -> None:
    """In the core without primitives, which simulates twice as fast."""
    folder, build = one
    texts = {"core": build.core.verilog(instances=False, identified=True)}
    texts["core_axi"] = (folder / "core_axi.v").read_text()
    for name, text in texts.items():
        (tmp_path / f"{name}.v").write_text(spoilt(text, module) if name == module else text)
    sources = [*tmp_path.glob("*.v"), folder / "tb" / f"{bench}.v"]
    built = tmp_path / "bench"
    subprocess.run(["iverilog", "-g2005", "-s", bench, "-o", built, *sources], check=True)

    def run(*options: str) -> tuple[int, str]:
        done = subprocess.run(
            ["vvp", "-n", built, *options], cwd=folder / "tb", capture_output=True, text=True
        )
        return done.returncode, done.stdout + done.stderr

    assert run()[0] == 0
    for k, (port, value, wanted) in enumerate(FAULTS[module]):
        code, said = run(f"+fault={k}")
        assert code == 1 and re.search(wanted, said), (port, value, said)


@ICARUS
def test_fusesoc(one: Design, tmp_path: Path) -> None:
    """It finds the core, and runs the bench from the folders that it copies."""
    root = tmp_path / "cores"
    shutil.copytree(one[0], root / "core")
    name = re.search(r"^name: (\S+)$", (root / "core" / "core.core").read_text(), re.M)
    assert name is not None and name[1] == "boresight:core:track-small:0"
    command = [Path(sys.executable).with_name("fusesoc"), "--cores-root", root]
    folders = {f"XDG_{n}_HOME": str(tmp_path) for n in ("CACHE", "CONFIG", "DATA", "STATE")}
    done = subprocess.run(
        [*command, "run", "--target=sim", name[1]],
        cwd=tmp_path,
        env={**os.environ, "HOME": str(tmp_path), **folders},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "PASS core_axi: 72 words of 24 records" in done.stdout + done.stderr


def test_readme_of_one_program(one: Design) -> None:
    folder, build = one
    text, core = (folder / "README.md").read_text(), build.core
    plan, form = core.schedule, core.program.format(core.program.outputs[0])
    gain = describe(core).find("gain")
    for line in (
        "# Core `track`",
        "Position and velocity from noisy positions.",
        "| input | `i__payload` | 33 | input record: bit 32 last, below it a word |",
        "| 0 | `dt` | `fixed<32,-2>` | s | 0 to 0.1 |  | time \\| step |",
        "| 2 | `seen` | `fixed<32,2>` |  | 0 to 1 | 0 | 1: new sample of z |",
        "| 3 | `w` | `fixed<32,1>` | ht | -1 to 1 | the last word again |  |",
        f"| 0 | {plan.latencies[0]} | `pos` | `{form}` | m | where it is |",
        "For example `dt` = 0.05 s is the word `0x33333333`.",
        f"| {gain.address} | `gain` | `fixed<32,2>` |  | 0 to 1 | 0.2 | share of the innovation ",
        "| 512 | `status` | 1 (write 1 to clear) | `framing`: a record had the wrong length",
        "| 513 | `updates` | | completed updates, modulo 2^W |",
    ):
        assert line in text, line
    assert f"out in cycle **{max(plan.latencies)}**" in text and f"**{plan.interval}**" in text
    assert "[[" not in text and "\n\n\n" not in text and "Program 0" not in text


@pytest.mark.parametrize(
    ("low", "high", "value"),
    [(0.0, 0.1, 0.05), (-8.0, 8.0, 4.0), (3.0, 5.0, 4.0), (-5.0, -3.0, -4.0)],
)
def test_an_example_lies_in_the_range(low: float, high: float, value: float) -> None:
    said = _example(Word("u", 16, "m", low=low, high=high), 20)
    assert said == f"`u` = {value:g} m is the word `0x{round(value * 2**16) & 0xFFFFF:05x}`"


def test_readme_of_several_programs(several: Design) -> None:
    text = (several[0] / "README.md").read_text()
    assert "Program 1, `half`: Without parameters, states and a time step." in text
    assert "### Records of `half`" in text and "a word in the low 18" in text
    assert "Register 516, `program`, holds the number of the program that runs" in text
    assert "no vendor primitives" in text and "spartan6.v" not in text
    assert "| `track.gain` |" in text and "`turn`: turns from 0 to 1" in text
