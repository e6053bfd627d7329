"""What README.md says of a core."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from boresight.gateware.description import describe
from boresight.gateware.texts.core import integration_files
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded

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


def test_area_and_clock_are_called_an_estimate(one: Design) -> None:
    build = one[1]
    used = SimpleNamespace(lut=1042, ff=900, dsp=8, ramb16=17.5)

    def resources(fmax: float | None) -> str:
        area: Any = SimpleNamespace(area=used, corner=lambda **_: SimpleNamespace(fmax_mhz=fmax))
        texts = integration_files(
            describe(build.core), recorded(build), generic=False, axi=False, area=area
        )
        return texts["README.md"].partition("## Resources\n\n")[2]

    text = resources(124.6)
    assert text.startswith(
        f"1 lane(s), {len(build.core.image.rom)} microwords. **Estimate** for XC"
    )
    assert "not from ISE: 1042 LUT, 900 flip-flops, 8 DSP48A1, 17.5 RAMB16; clock 125 MHz" in text
    assert "clock not known" in resources(None)
