"""Gowin: GW2A and GW5A, their cells, the registers of block RAM and multipliers, their parts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from boresight.gateware.synthesis.device import BLOCK_18K, Device
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family, Router
from boresight.gateware.synthesis.registers import Absorption, FlipFlop, Reading, absorb


def _device(
    name: str, counts: Mapping[str, tuple[int, str]], *, grades: tuple[int, ...], part: str
) -> Device:
    """A part; counts are those of nextpnr's database."""
    return Device(
        name=name,
        resources=counts,
        grades=grades,
        options=("--device", part + "{grade}", "--vopt", f"family={_CHIP[name]}"),
    )


#: Of the part numbers, the one in nextpnr's database.
_CHIP: Final = {"gw2a-18": "GW2A-18C", "gw5a-25": "GW5A-25A"}


def _flip_flop(cell: dict[str, Any]) -> FlipFlop | None:
    if cell["type"] not in ("DFF", "DFFE"):
        return None
    wires = cell["connections"]
    enable = wires["CE"][0] if cell["type"] == "DFFE" else "1"
    return FlipFlop(
        clock=wires["CLK"][0], d=wires["D"][0], q=wires["Q"][0], enable=(enable, True), plain=True
    )


def _memory(cell: str, port: str, register: str, mode: str) -> Absorption:
    """The output register of a port of a memory."""
    return Absorption(
        cell=cell,
        pins=(f"DO{port}",),
        output=True,
        applies=lambda p: p.get(mode) == "0",
        parameters={mode: "1"},
        clock=f"CLK{register}",
        enables=(f"OCE{port}",),
        agrees=f"CE{register}",
        idle=(f"RESET{register}",),
    )


def _multiplier(cell: str, pins: str, register: str, *, output: bool = False) -> Absorption:
    """A register of a multiplier; all of one have one enable."""
    return Absorption(
        cell=cell,
        pins=(pins,),
        output=output,
        applies=lambda p: p.get(register, "0") == "0",
        parameters={register: "1"},
        clock="CLK",
        enables=("CE",),
        idle=("RESET",),
    )


_RULES: Final = (
    *(_memory(f"SP{x}", "", "", "READ_MODE") for x in ("", "X9")),
    *(_memory(f"SDP{x}", "", "B", "READ_MODE") for x in ("B", "X9B")),
    *(_memory(f"DP{x}", "A", "A", "READ_MODE0") for x in ("B", "X9B")),
    *(_memory(f"DP{x}", "B", "B", "READ_MODE1") for x in ("B", "X9B")),
    *(
        _multiplier(cell, pins, register, output=pins == "DOUT")
        for cell in ("MULT9X9", "MULT18X18", "MULT36X36")
        for pins, register in (("A", "AREG"), ("B", "BREG"), ("DOUT", "OUT_REG"))
    ),
)
_READING: Final = Reading(flip_flop=_flip_flop, constants={"GND": ("G", "0"), "VCC": ("V", "1")})
_CELLS: Final = {
    **{f"LUT{inputs}": {"lut": 1} for inputs in range(1, 5)},
    "ALU": {"lut": 1},
    **{f"MUX2_LUT{inputs}": {} for inputs in range(5, 9)},
    **{
        f"DFF{kind}{enable}": {"ff": 1} for kind in ("", "R", "S", "C", "P") for enable in ("", "E")
    },
    **{f"{kind}{x}": {"ram": 1} for kind in ("SP", "pROM") for x in ("", "X9")},
    **{f"{kind}{x}": {"ram": 1} for kind in ("DP", "SDP") for x in ("B", "X9B")},
    **{name: {} for name in ("GND", "VCC")},
}


def _synthesis(family: str) -> str:
    return NO_RW_CHECK + f"synth_gowin -family {family} -noiopads -nolutram"


#: nextpnr takes no clock from a pin without its place, and routes its oscillator's clock as any
#: net, so the clock of a core without pins has no source: an ideal one.
GW2A: Final = Family(
    name="gw2a",
    title="Gowin GW2A",
    synthesis=_synthesis("gw2a"),
    cells={**_CELLS, "MULT9X9": {"dsp": 0.5}, "MULT18X18": {"dsp": 1}, "MULT36X36": {"dsp": 4}},
    flip_flop=("DFF", {}, "CLK", "D", "Q"),
    drivers={"clk": None},
    devices=(
        _device(
            "gw2a-18",
            {
                "lut": (20736, "LUT4"),
                "ff": (15552, "flip-flop"),
                "dsp": (48, "MULT18X18"),
                "ram": (46, "BSRAM of 18 Kbit"),
            },
            grades=(7, 8, 9),
            part="GW2A-LV18PG256",
        ),
    ),
    memory_shapes=BLOCK_18K,
    router=Router(
        program="nextpnr-himbaechel-gowin",
        extra="gowin",
        grades={7: "C7/I6", 8: "C8/I7", 9: "C9/I8"},
        untimed=frozenset({"MULT9X9", "MULT18X18", "MULT36X36"}),
    ),
    absorb=lambda netlist, top: absorb(netlist, top, _READING, _RULES),
)
#: yosys 0.70 maps no multiplier to MULT12X12 or MULTALU27X18: tables multiply.
GW5A: Final = Family(
    name="gw5a",
    title="Gowin GW5A",
    synthesis=_synthesis("gw5a"),
    cells=_CELLS,
    flip_flop=("DFFRE", {}, "CLK", "D", "Q"),
    drivers={"clk": None},
    devices=(
        _device(
            "gw5a-25",
            {
                "lut": (23040, "LUT4"),
                "ff": (23040, "flip-flop"),
                "dsp": (28, "MULTALU27X18"),
                "ram": (56, "BSRAM of 18 Kbit"),
            },
            grades=(1, 2),
            part="GW5A-LV25MG121N",
        ),
    ),
    memory_shapes=BLOCK_18K,
    router=Router(
        program="nextpnr-himbaechel-gowin", extra="gowin", grades={1: "C1/I0", 2: "C2/I1"}
    ),
)
