"""Nexus: CrossLink-NX and Certus-NX, their cells, the registers of MULT18X18, their parts."""

from __future__ import annotations

from typing import Any, Final

from boresight.gateware.synthesis.device import BLOCK_18K, Device
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family, Router
from boresight.gateware.synthesis.registers import Absorption, FlipFlop, Reading, absorb


def _device(name: str, lut: int, dsp: int, ram: int) -> Device:
    """A part; counts are those of nextpnr's database."""
    counts = {"lut": (lut, "LUT4"), "ff": (lut, "flip-flop")}
    counts |= {"dsp": (dsp, "MULT18X18"), "ram": (ram, "EBR, block RAM of 18 Kbit")}
    return Device(
        name=name,
        resources=counts,
        grades=(7, 8, 9),
        options=("--device", name.upper() + "-{grade}BG256C"),
    )


def _flip_flop(cell: dict[str, Any]) -> FlipFlop | None:
    if cell["type"] != "FD1P3IX":
        return None
    wires = cell["connections"]
    return FlipFlop(
        clock=wires["CK"][0],
        d=wires["D"][0],
        q=wires["Q"][0],
        enable=(wires["SP"][0], True),
        plain=wires["CD"] == ["0"],
    )


def _multiplier(pins: str, register: str, suffix: str, *, output: bool = False) -> Absorption:
    """A register of MULT18X18; ``suffix``: of its enable and reset."""
    return Absorption(
        cell="MULT18X18",
        pins=(pins,),
        output=output,
        applies=lambda p: p.get(register) == "BYPASS",
        parameters={register: "REGISTER"},
        clock="CLK",
        enables=(f"CE{suffix}",),
        idle=(f"RST{suffix}",),
    )


_RULES: Final = (
    _multiplier("A", "REGINPUTA", "A"),
    _multiplier("B", "REGINPUTB", "B"),
    _multiplier("Z", "REGOUTPUT", "OUT", output=True),
)
_READING: Final = Reading(flip_flop=_flip_flop, constants={"VLO": ("Z", "0"), "VHI": ("Z", "1")})


def _absorb(netlist: dict[str, Any], top: str) -> int:
    """Leave the input of the first cell of a carry chain open, and use registers.

    The former comes from the chain beside it, so that nextpnr takes no driver there; the cell does
    not read it. abc9 ties what is open to 0 (github.com/YosysHQ/yosys/issues/5639).
    """
    for cell in netlist["modules"][top]["cells"].values():
        if cell["type"] == "CCU2" and cell["parameters"]["INIT1"] == "0x00AA":
            cell["connections"].pop("CIN", None)
            cell["port_directions"].pop("CIN", None)
    return absorb(netlist, top, _READING, _RULES)


#: WIDEFN9 is two LUT4 and a multiplexer, CCU2 two and a carry, DPR16X4 four and the two of its
#: write port. The output registers of memories stay unused: what enables them neither yosys nor
#: nextpnr says.
NEXUS: Final = Family(
    name="nexus",
    title="Lattice Nexus",
    # Multipliers are mapped before synth_nexus: its pass that uses their registers (yosys 0.70,
    # lattice_dsp_nexus) connected an operand of one of a core's four to 0.
    synthesis="proc; wreduce t:$mul; techmap -map +/mul2dsp.v -D DSP_A_MAXWIDTH=18 "
    "-D DSP_B_MAXWIDTH=18 -D DSP_NAME=$__NX_MUL18X18 t:$mul; "
    "techmap -map +/lattice/dsp_map_nexus.v t:$__NX_MUL18X18; "
    + NO_RW_CHECK
    + "synth_nexus -noiopad",
    cells={
        "LUT4": {"lut": 1},
        "INV": {"lut": 1},
        "WIDEFN9": {"lut": 2},
        "CCU2": {"lut": 2},
        "DPR16X4": {"lut": 6},
        **{f"FD1P3{kind}X": {"ff": 1} for kind in "BDIJ"},
        **{name: {"dsp": 0.5} for name in ("MULT9X9", "MULTPREADD9X9")},
        **{f"MULT{kind}18X18": {"dsp": 1} for kind in ("", "PREADD", "ADDSUB")},
        **{name: {"dsp": 2} for name in ("MULT18X36", "MULTADDSUB9X9WIDE")},
        **{name: {"dsp": 4} for name in ("MULT36X36", "MULTADDSUB36X36")},
        **{name: {"ram": 1} for name in ("DP16K", "PDP16K", "PDPSC16K")},
        **{name: {} for name in ("VHI", "VLO")},
    },
    flip_flop=("FD1P3IX", {"GSR": "DISABLED"}, "CK", "D", "Q"),
    drivers={"clk": ("DCC", {}, "CLKO"), "0": ("VLO", {}, "Z")},
    devices=(
        _device("lifcl-17", 13824, 24, 24),
        _device("lifcl-40", 32256, 56, 84),
        _device("lfd2nx-40", 32256, 56, 84),
    ),
    memory_shapes=BLOCK_18K,
    # docs/targets.md#measured has the commands.
    clocks={(1, 7): 110.4, (1, 9): 154.8},
    clocks_source="clocks of four filters routed on lifcl-17, speed 7, 3 seeds",
    # With --tmg-ripup and a clock that is not reached the router did not end (135 rounds).
    router=Router(program="nextpnr-nexus", extra="nexus"),
    absorb=_absorb,
)
