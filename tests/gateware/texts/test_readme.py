"""Texts about a core: README, records, bench, waves, head of the Verilog."""

import json
import re
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth.lib.wiring import Component

from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.engine.engine import Engine
from boresight.gateware.texts.bench import Recorded, expected_hex, input_hex
from boresight.gateware.texts.core import integration_files, verilog_head
from boresight.gateware.texts.wave import Drawing, bus_drawing, record_drawing
from boresight.model.attitude import estimator
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.rtl.simulators import available
from tests.support.linked import Inner
from tests.support.shared import Motion, Row
from tests.support.track import Track

# -- what README.md says of a core ----------------------------------------------------------------

Design = tuple[Path, Build]


def test_one_program(one: Design) -> None:
    folder, build = one
    text, core = (folder / "README.md").read_text(), build.core
    plan, form = core.schedule, core.program.format(core.program.outputs[0])
    for line in (
        "# Core `track`",
        "Position and velocity from noisy positions.",
        "| input | `i__payload` | 33 | input record: bit 32 last, below it a word |",
        "| 0 | `dt` | `fixed<32,-2>` | s | 0 to 0.1 |  | time \\| step |",
        "| 1 | `z` | `fixed<32,8>` | m | -100 to 100 | -100.0 |  |",
        "| 2 | `seen` | `fixed<32,2>` |  | 0 to 1 | 0 | 1: new sample of z |",
        "| 3 | `w` | `fixed<32,1>` | ht | -1 to 1 | the last word again |  |",
        f"| 0 | {plan.latencies[0]} | `pos` | `{form}` | m | where it is |",
        f"| 2 | {plan.latencies[2]} | `status` | `fixed<32,2>` | bits | 0: no position seen; "
        "2: never |",
        "For example `dt` = 0.05 s is the word `0x33333333`.",
        "| 512 | `status` | 1 (write 1 to clear) | `framing`: a record had the wrong length and "
        "was dropped |",
    ):
        assert line in text, line
    assert (
        f"out in cycle **{max(plan.latencies)}**" in text and f"**{plan.interval}** cycles" in text
    )
    assert "`ht`: half turns" in text and "`bits`: the value is an integer" in text
    assert "`turn`" not in text and "Program 0" not in text and "Register 516" not in text
    assert "`core_sim.v`" in text and "## AXI" in text and "**Estimate**" not in text
    assert "Area and clock are not known" in text


def test_several(linked: Design) -> None:
    folder, build = linked
    text = (folder / "README.md").read_text()
    assert "Program 0, `middle`: Reads both words of `Inner`, with states of its own." in text
    assert "### Records of `inner`" in text
    assert "Register 516, `program`, holds the number of the program that runs" in text
    assert "`half` is no word of the record: it is `half` of program `inner`, as" in text
    middle = text[text.index("### Records of `middle`") : text.index("### Records of `inner`")]
    assert re.findall(r"^\| \d \| `(\w+)` \|", middle, re.M) == ["c", "d"]
    assert "no vendor primitives" in text and "`core_sim.v`" not in text
    assert "a word in the low 18" in text


def test_programs_that_share_states() -> None:
    build = Build(Row(), Motion())
    text = integration_files(describe(build.core), recorded(build), generic=True, axi=False)
    readme = text["README.md"]
    row = readme[readme.index("### Records of `row`") : readme.index("### Records of `motion`")]
    assert "It has the states of program `motion`:" in row and readme.count("the states of") == 1
    assert "keeps its states while others run, but for those that share them." in readme
    alone = Build(Row())
    text = integration_files(describe(alone.core), recorded(alone), generic=True, axi=False)
    assert "states of program" not in text["README.md"]


def test_files_and_links(one: Design, linked: Design) -> None:
    """Every file that it names is there, and every section has a text."""
    for folder, _ in (one, linked):
        text = (folder / "README.md").read_text()
        named = re.findall(r"^\| `([\w./]+)` \| ", text[: text.index("## In your design")], re.M)
        missing = {name for name in named if not (folder / name).exists()}
        assert len(named) >= 8 and missing == {"report.json"}
        for name in re.findall(r"`(integration/\S+?|tb/\S+?)`", text):
            assert (folder / name).exists(), name
        assert not re.search(r"^## [^\n]+\n+##? ", text, re.M) and "[[" not in text
        assert "\n\n\n" not in text


def test_flags_are_those_of_the_register_map(one: Design) -> None:
    folder, build = one
    text = (folder / "README.md").read_text()
    for register in describe(build.core).registers:
        for bit in register.fields:
            assert f"| {register.address} | `{register.name}` | {bit.bit}" in text
            assert f"`{bit.name}`: {bit.meaning}" in text


# -- lines of the bench's words -------------------------------------------------------------------


@pytest.fixture(scope="module")
def build() -> Build:
    return Build(Track(), word=21)


def run_of(saturated: list[bool]) -> Recorded:
    count = len(saturated)
    inputs = np.arange(4 * count).reshape(count, 4) - 6
    return Recorded(0, inputs, -np.arange(3 * count).reshape(count, 3), np.array(saturated), "")


def test_input_lines(build: Build) -> None:
    """Cycles and flags with the first word of a record; pauses in the second half."""
    lines = input_hex(describe(build.core), [run_of([False, True, False, True])]).splitlines()
    marks = [line.split("_")[:2] for line in lines]
    interval = f"{build.core.schedule.interval:04x}"
    none = "0000"
    assert marks == [
        *([none, "0"], [none, "0"], [none, "0"], [none, "1"]),
        *([interval, "4"], [none, "0"], [none, "0"], [none, "1"]),
        *([none, "e"], [none, "2"], [none, "2"], [none, "3"]),
        *([none, "6"], [none, "2"], [none, "2"], [none, "3"]),
    ]
    assert [line.split("_")[2] for line in lines[5:8]] == ["1fffff", "000000", "000001"]


def test_expected_lines(build: Build) -> None:
    """Cycles where there are no pauses: in the first half, or more than that."""
    lines = expected_hex(describe(build.core), [run_of([False, True, False])] * 2).splitlines()
    assert lines[:9] == lines[9:]
    cycles = [f"{c:04x}" for c in build.core.schedule.latencies]
    assert [line[:4] for line in lines[:9]] == [*cycles, *cycles, "0000", "0000", "0000"]
    assert [line[5] for line in lines[:9]] == ["0", "0", "1"] * 3
    assert [line[7:] for line in lines[:3]] == ["000000", "1fffff", "1ffffe"]


# -- drawings say what the core does: it is driven as they say ------------------------------------


@pytest.fixture(scope="module")
def core() -> Core:
    return Build(Track()).core


def row(drawing: Drawing, name: str) -> tuple[Any, ...]:
    return dict(drawing.rows)[name]


def test_a_record(core: Core, simulate: Any) -> None:
    """Two records offered one after the other, and every shown cycle of the first."""
    drawing = record_drawing(describe(core).programs[0], 32)
    words = [core.program.values[n].name for n in core.program.streamed]
    seen: dict[int, tuple[Any, ...]] = {}
    dut: Component = Engine(machine=core.machine, image=core.image)

    async def bench(ctx: Any) -> None:
        ctx.set(dut.o.ready, 1)
        while not ctx.get(dut.i.ready):
            await ctx.tick()
        n_in = 0
        n_out = 0
        for cycle in range(1, core.schedule.interval + 2):
            word, last = n_in % len(words), n_in % len(words) == len(words) - 1
            ctx.set(dut.i.payload, {"data": 0, "last": last})
            ctx.set(dut.i.valid, 1)
            ready, valid = ctx.get(dut.i.ready), ctx.get(dut.o.valid)
            output = core.program.output_names[n_out] if valid else None
            mark = ctx.get(dut.o.payload.last) if valid else None
            seen[cycle] = (1, ready, words[word], int(last), valid, 1, output, mark)
            n_in, n_out = n_in + ready, n_out + valid
            await ctx.tick()

    simulate(dut, bench)
    assert drawing.cycles[0] == 1 and drawing.cycles[-1] == core.schedule.interval + 1
    assert set(core.schedule.latencies) >= {max(core.schedule.latencies)} <= set(drawing.cycles)
    for k, cycle in enumerate(drawing.cycles):
        assert tuple(values[k] for _, values in drawing.rows) == seen[cycle], cycle


@pytest.mark.parametrize("kind", [Track, Inner])
def test_the_bus(kind: Any, simulate: Any) -> None:
    """A parameter is written two cycles long; without one a flag is cleared at once."""
    core = Build(kind()).core
    drawing = bus_drawing(describe(core))
    dut: Component = Engine(machine=core.machine, image=core.image)
    assert len(drawing.cycles) == (4 if kind is Track else 3)

    async def bench(ctx: Any) -> None:
        await ctx.tick().repeat(8)
        for k in range(len(drawing.cycles)):
            addr, w_stb = row(drawing, "bus__addr")[k], row(drawing, "bus__w_stb")[k]
            ctx.set(dut.bus.addr, 513 if addr is None else int(addr))
            ctx.set(dut.bus.w_stb, w_stb)
            assert ctx.get(dut.bus.w_ack) == row(drawing, "bus__w_ack")[k]
            if row(drawing, "bus__r_data")[k] == "status":
                assert ctx.get(dut.bus.r_data) & 0b0111 == 0b0100
            await ctx.tick()

    simulate(dut, bench)


DRAWING = Drawing(
    (1, 2, 5, 6), (("bit", (0, 1, 1, 0)), ("word", ("a", "a", None, "b")), ("any", (None, 1, 0, 0)))
)


def test_text() -> None:
    assert DRAWING.text() == (
        "cycle | 1 | 2  .. | 5 | 6\n"
        "bit   ____/‾‾‾ .. ‾‾‾‾\\___\n"
        "word  | a      .. ....| b\n"
        "any   ....‾‾‾‾ .. \\_______\n"
    )


def test_wavedrom() -> None:
    drawn = json.loads(DRAWING.wavedrom())["signal"]
    assert [s["wave"] for s in drawn] == ["p.|..", "==|==", "01|.0", "=.|x=", "x1|0."]
    assert [s.get("data") for s in drawn] == [None, ["1", "2", "5", "6"], None, ["a", "b"], None]
    text = DRAWING.markdown()
    assert text.count("```") == 4 and DRAWING.text() in text and DRAWING.wavedrom() in text


def test_waves_have_a_letter_for_each_column(core: Core) -> None:
    drawing = record_drawing(describe(core).programs[0], 32)
    gaps = sum(b != a + 1 for a, b in zip(drawing.cycles, drawing.cycles[1:], strict=False))
    waves = [s["wave"] for s in json.loads(drawing.wavedrom())["signal"]]
    assert {len(wave) for wave in waves} == {len(drawing.cycles) + gaps}


# -- the head of a core's Verilog says what the module below it is --------------------------------


def text_of(core: Core, *, instances: bool, identified: bool | None = None) -> str:
    known = instances if identified is None else identified
    return verilog_head(describe(core), instances=instances, identified=known)


INSTANCES = pytest.mark.parametrize("instances", [True, False])


@cache
def core_of(*names: str, word: int = 32) -> Core:
    return Build(*(estimator(n) for n in names), config="small", word=word).core


@INSTANCES
@pytest.mark.parametrize("word", [32, 24])
def test_ports_are_those_of_the_module(instances: bool, word: int) -> None:
    core = core_of("complementary", word=word)
    verilog = core.verilog(instances=instances)
    module = verilog[: verilog.index("endmodule")]
    results = {
        (side, name, int(high or 0) + 1)
        for side, high, name in re.findall(
            r"^  (input|output) (?:\[(\d+):0\] )?(\w+);$", module, re.M
        )
    }
    pins = describe(core).pins
    assert results == {(pin.direction, pin.name, pin.bits) for pin in pins}
    text = text_of(core, instances=instances)
    for pin in pins:
        width = rf"\[{pin.bits - 1}:0\] +" if pin.bits > 1 else ""
        line = rf"^//   {pin.direction} +{width}{pin.name} +{re.escape(pin.meaning)}$"
        assert re.search(line, text, re.M)


def test_generic() -> None:
    """That it has the build identifier the bench beside it says (`gateware.texts.core`)."""
    core = core_of("complementary", word=24)
    generic, simulated = (core.verilog(instances=False, identified=k) for k in (True, False))
    assert generic != simulated and "DSP48A1" not in generic and "LUT6" not in generic
    assert core.verilog(instances=False) is simulated
    texts = [text_of(core, instances=False, identified=k) for k in (True, False)]
    said = ["it has no vendor primitives", "Its build identifier reads 0"]
    assert [[s in text for s in said] for text in texts] == [[True, False], [False, True]]


@INSTANCES
def test_what_it_says(instances: bool) -> None:
    core = core_of("complementary", "mekf")
    text = text_of(core, instances=instances)
    assert core.digest in text and "configuration small, 32-bit words" in text
    assert ("LUT6" in text) == instances
    for number, part in enumerate(core.parts):
        plan = part.schedule
        cycles = ", ".join(map(str, plan.latencies))
        assert f"Program {number}, {part.program.name}: takes a record every {plan.interval} " in (
            text
        )
        assert f"// cycles {cycles}," in text
    assert "//   in  0   dt                   fixed<32,-1>   s\n" in text
    assert all(line == "" or line.startswith("//") for line in text.split("\n"))
    assert max(map(len, text.splitlines())) <= 100 and text.isascii()


@pytest.mark.skipif(not available("icarus"), reason="Icarus Verilog: apt-get install iverilog")
def test_the_instance_connects(tmp_path: Path) -> None:
    """Declarations from the table of ports, the instance from the text."""
    core = core_of("complementary", word=24)
    text = text_of(core, instances=False)
    lines = [line[3:] for line in text.splitlines()]
    instance = lines[lines.index("Instance:") + 1 : lines.index("  );") + 1]
    wires = [f"  wire [{pin.bits - 1}:0] {pin.name};" for pin in describe(core).pins]
    user = ["module user;", *wires, *instance, "endmodule"]
    (tmp_path / "user.v").write_text("`default_nettype none\n" + "\n".join(user) + "\n")
    (tmp_path / "core_sim.v").write_text(text + core.verilog(instances=False))
    done = subprocess.run(
        ["iverilog", "-g2001", "-Wall", "-Wno-timescale", "-tnull", "-s", "user"]
        + ["core_sim.v", "user.v"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    about = [line for line in done.stderr.splitlines() if line.startswith("user.v")]
    assert not done.returncode and not about, done.stderr
