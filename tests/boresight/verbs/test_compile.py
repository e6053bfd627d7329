"""`boresight compile`: everything of a core, and of one that several programs share."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import boresight
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.tools import Run
from boresight.model.errors import InputError
from boresight.verbs import compile as module
from boresight.verbs.compile import core_files, project_files

BOTH = ["mine", "other"]


def files(folder: str) -> set[str]:
    """Relative paths of all files, but that of ours."""
    paths = Path(folder).rglob("*")
    names = {path.relative_to(folder).as_posix() for path in paths if path.is_file()}
    return {name for name in names if not name.startswith(".")}


def test_all_files(here: Path, data, said) -> None:
    report = data("compile mine.py -o out")
    assert files("out") == {*core_files(["mine"], "xc6slx9")}
    assert json.loads(Path("out/report.json").read_text())["digest"] == report["digest"]
    assert report["timing"]["latency_cycles"]["predicted"] < report["timing"]["interval_cycles"]
    text = said("compile mine.py -o out -q")
    assert "proven: 10 operations, microcode, all inputs" in text
    assert [line.split() for line in text.splitlines() if " pos " in line] == [
        ["mine", "pos", str(report["timing"]["latency_cycles_by_output"]["pos"])]
    ]


def test_a_stated_range_that_is_wrong_is_told_without_a_log(here: Path, said) -> None:
    source = Path("mine.py").read_text().replace("p.alpha * innovation", "CLAIM")
    claim = 'ops.bounded(p.alpha * innovation, -1.0, 1.0, "hoped")'
    Path("mine.py").write_text("from boresight import ops\n" + source.replace("CLAIM", claim))
    text = said("compile mine.py -o out -q")
    assert "0 of 1 proven by interval arithmetic; boresight check compares the others" in text
    assert "warning: stated range [-1, 1], hoped (mine.py, line " in text and "is BROKEN: " in text


def test_a_part_that_is_too_small(here: Path) -> None:
    with pytest.raises(InputError, match=r"30 SB_RAM40_4K.*, found 31 .*narrower --word, or"):
        boresight.compile("mekf", target="ice40-up5k", word=26)


def test_a_target_without_primitives(here: Path, data) -> None:
    data("compile mine.py -o out --target generic")
    assert "DSP48A1" not in Path("out/core.v").read_text()
    assert data("compile mine.py -o out --synth")["resources"]["lut"] > 100
    assert "DSP48A1" in Path("out/core.v").read_text()


def test_a_shared_core_on_a_board(here: Path, data) -> None:
    out = here / "out"
    boresight.new("other")
    line = "compile mine.py other.py --board mimas --top records -o out"
    report = data(f"{line} --param other.beta=4")
    assert [*report["programs"]] == BOTH
    assert {*project_files("mimas", system=False)} <= files(str(out))
    assert "Clock    70 MHz" in (out / "ise-mimas" / "README.txt").read_text()
    registers = json.loads((out / "registers.json").read_text())
    by_name = {r["name"]: r for r in registers["registers"]}
    assert by_name["program"]["names"] == BOTH
    first, second = (by_name[f"{name}.beta"] for name in BOTH)
    assert second["reset"] == 4 << second["frac"] != first["reset"]


REFUSED = {
    "--target nosuch": "target: wanted one of",
    "--clock 100": "clock: wanted a design that is routed, found no --route",
    "--board mimas --target ecp5-25k": "target: wanted xc6slx9, the part of mimas",
    "--board icebreaker": "board: wanted a part that holds the complete system",
    "--route": "route: wanted a target that an open tool routes",
    "--word 40": "word",
    "--config huge": "config",
    "--param alpha=9": "alpha: wanted 0 to 1",
}


@pytest.mark.parametrize("more", REFUSED)
def test_refused(more: str, here: Path, refused) -> None:
    assert REFUSED[more] in refused(f"compile mine.py -o out {more}")
    assert not Path("out").exists()


def test_programs_whose_headers_would_define_the_same_name(here: Path, refused) -> None:
    text = Path("mine.py").read_text()
    Path("mine.py").write_text(text.replace("alpha", "rate_alpha"))
    Path("rate.py").write_text(text.replace("class Mine", "class Mine_rate"))
    said = refused("compile mine.py rate.py -o out")
    assert said.startswith("mine and mine_rate: wanted C headers that define different names")
    assert ", found MINE_RATE_ALPHA_FRAC in both; rename" in said


def test_a_clock_that_is_not_reached_fails(here: Path, monkeypatch) -> None:
    netlist = {"modules": {"core": {"cells": {}}}}
    used = dict.fromkeys(("lut", "ff", "dsp", "ram"), 1.0)
    target = TARGETS["ecp5-25k"]
    mapped = Mapped(target=target, netlist=netlist, used=used, version="yosys")
    routed = Routed(mapped=mapped, runs=(Run(1, 79.3, {}),), version="nextpnr")
    monkeypatch.setattr(module, "check_routable", lambda *given: None)  # without its router
    monkeypatch.setattr(module, "route_core", lambda *given, **options: routed)
    for clock, said in ((80.0, ["clock 79.3 MHz, below 80 MHz"]), (79.0, [])):
        options = {"target": "ecp5-25k", "route": True, "clock": clock}
        result = boresight.compile("mine.py", output=f"out{clock:g}", **options)
        assert result.failures == said and result.good is not bool(said)
