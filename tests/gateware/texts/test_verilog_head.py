"""The head of a core's Verilog says what the module below it is."""

from __future__ import annotations

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.texts.core import verilog_head
from boresight.model.estimators import estimator
from boresight.sim.levels.build import Build
from boresight.sim.rtl.simulators import available


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
    found = {
        (side, name, int(high or 0) + 1)
        for side, high, name in re.findall(
            r"^  (input|output) (?:\[(\d+):0\] )?(\w+);$", module, re.M
        )
    }
    pins = describe(core).pins
    assert found == {(pin.direction, pin.name, pin.bits) for pin in pins}
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
