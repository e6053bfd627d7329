"""ECP5: its cells, the registers of DP16KD and MULT18X18D, its parts."""

from __future__ import annotations

from typing import Any, Final

from boresight.gateware.synthesis.device import BLOCK_18K, Device
from boresight.gateware.synthesis.family import NO_RW_CHECK, Family, Router
from boresight.gateware.synthesis.registers import Absorption, FlipFlop, Reading, absorb


def _device(size: str, lut: int, dsp: int, ram: int) -> Device:
    """A part; counts are those of nextpnr's database."""
    counts = {"lut": (lut, "LUT4"), "ff": (lut, "flip-flop")}
    counts |= {"dsp": (dsp, "MULT18X18D"), "ram": (ram, "DP16KD, block RAM of 18 Kbit")}
    return Device(
        name=f"ecp5-{size}",
        resources=counts,
        grades=(6, 7, 8),
        options=(f"--{size}", "--package", "CABGA381", "--speed", "{grade}"),
    )


def _flip_flop(cell: dict[str, Any]) -> FlipFlop | None:
    if cell["type"] != "TRELLIS_FF":
        return None
    parameters, wires = cell["parameters"], cell["connections"]
    reset = wires.get("LSR", ["0"])[0]
    mux = parameters.get("CEMUX", "1").strip()
    return FlipFlop(
        clock=wires["CLK"][0],
        d=wires["DI"][0],
        q=wires["Q"][0],
        enable=("1", True) if mux == "1" else (wires["CE"][0], mux == "CE"),
        plain=reset == "0"
        and parameters.get("LSRMUX", "LSR") == "LSR"
        and parameters.get("REGSET", "RESET") == "RESET"
        and parameters.get("CLKMUX", "CLK") == "CLK",
    )


def _table(cell: dict[str, Any]) -> tuple[tuple[int | str, ...], int, int | str] | None:
    if cell["type"] != "LUT4":
        return None
    wires = cell["connections"]
    inputs = tuple(wires.get(port, ["0"])[0] for port in "ABCD")
    return inputs, int(cell["parameters"]["INIT"], 2), wires["Z"][0]


def _width(parameters: dict[str, Any], port: str) -> int:
    return int(str(parameters.get(f"DATA_WIDTH_{port}", "10010")), 2)


def _memory(port: str) -> Absorption:
    """The output register of one port of DP16KD, of up to 18 bits."""
    return Absorption(
        cell="DP16KD",
        pins=(f"DO{port}",),
        output=True,
        applies=lambda p: _width(p, "B") < 36 and p.get(f"REGMODE_{port}") == "NOREG",
        parameters={f"REGMODE_{port}": "OUTREG"},
        clock=f"CLK{port}",
        enables=(f"OCE{port}",),
        agrees=f"CE{port}",
    )


#: 36 bits are written by port A and read by port B, on the outputs of both.
_WIDE_MEMORY: Final = Absorption(
    cell="DP16KD",
    pins=("DOA", "DOB"),
    output=True,
    applies=lambda p: _width(p, "B") == 36 and p.get("REGMODE_B") == "NOREG",
    parameters={"REGMODE_A": "OUTREG", "REGMODE_B": "OUTREG"},
    clock="CLKB",
    enables=("OCEA", "OCEB"),
    agrees="CEB",
)


def _multiplier(pins: str, register: str, *, output: bool = False) -> Absorption:
    """A register of MULT18X18D."""
    return Absorption(
        cell="MULT18X18D",
        pins=(pins,),
        output=output,
        applies=lambda p: p.get(f"{register}_CLK", "NONE") == "NONE",
        parameters={
            f"{register}_CLK": "CLK0",
            f"{register}_CE": "CE0",
            f"{register}_RST": "RST0",
            "GSR": "DISABLED",
        },
        clock="CLK0",
        enables=("CE0",),
        wires={"RST0": "0"},
    )


_RULES: Final = (
    *(_WIDE_MEMORY, _memory("A"), _memory("B")),
    *(_multiplier("A", "REG_INPUTA"), _multiplier("B", "REG_INPUTB")),
    _multiplier("P", "REG_OUTPUT", output=True),
)
_READING: Final = Reading(flip_flop=_flip_flop, table=_table)

#: LUT4 and slices of two; CCU2C is two of their LUTs, PFUMX and L6MUX21 are beside them. What the
#: tool says of a part is all that can be used: of the 85k's 83,640 and so on.
ECP5: Final = Family(
    name="ecp5",
    title="Lattice ECP5",
    # A word leaves the block RAM after 5.8 ns, so memories of up to 64 words may become tables. A
    # reset that waits for the enable would be the enable, late as it is, and one more table on the
    # way to LSR: such resets become logic in front of the data. A net takes about 1 ns as routed;
    # with this instead of synth_ecp5's 0.3 ns abc9 makes fewer levels.
    synthesis=NO_RW_CHECK + "synth_ecp5 -run :map_ram; "
    "setattr -unset ram_style t:$mem_v2 r:SIZE<=64 %i; synth_ecp5 -run map_ram:map_ffs; "
    "dffunmap -srst-only t:$sdffce t:$_SDFFCE_*; synth_ecp5 -run map_ffs:map_luts; "
    "techmap -map +/lattice/latches_map.v; abc9 -W 1000; clean; synth_ecp5 -run map_cells:",
    cells={
        "LUT4": {"lut": 1},
        "CCU2C": {"lut": 2},
        "PFUMX": {},
        "L6MUX21": {},
        "TRELLIS_DPR16X4": {"lut": 6},
        "TRELLIS_FF": {"ff": 1},
        "MULT18X18D": {"dsp": 1},
        "DP16KD": {"ram": 1},
        **{name: {} for name in ("EHXPLLL", "DCCA", "TRELLIS_IO", "SGSR")},
    },
    flip_flop=("TRELLIS_FF", {"CEMUX": "1 ", "GSR": "DISABLED"}, "CLK", "DI", "Q"),
    devices=(
        _device("25k", 24288, 28, 56),
        _device("45k", 43848, 72, 108),
        _device("85k", 83640, 156, 208),
    ),
    memory_shapes=BLOCK_18K,
    # docs/targets.md#measured has the commands.
    clocks={
        (1, 7): 79.4,
        (1, 9): 129.5,
        (1, 10): 132.4,
        (1, 12): 147.1,
        (2, 9): 104.4,
        (2, 10): 115.7,
    },
    clocks_source="clocks of four filters routed on ecp5-25k, speed 6, 1 to 5 seeds",
    router=Router(
        program="nextpnr-ecp5",
        extra="ecp5",
        pins=("--lpf", "top.lpf"),
        placed=("--textcfg", "top.config"),
        packer=("ecppack", "--compress"),
        bitstream="top.bit",
        options=("--tmg-ripup",),
    ),
    absorb=lambda netlist, top: absorb(netlist, top, _READING, _RULES),
)
