"""The families of FPGAs as data, and every target: a part at a speed grade, by its name.

Counts of cells are those of nextpnr's database; of Spartan-6 of Xilinx DS160, and of ISE's map
reports for xc6slx9; of Artix-7 and Cyclone V E, which no router of PyPI has, of their overviews
(Xilinx DS180, Intel CV-51001).
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Final

from boresight.gateware.synthesis.family import Absorption, Device, Family, FlipFlop, Router, Target
from boresight.gateware.synthesis.spartan6 import estimate_clock

#: Words and bits that a block RAM of 18 Kbit can have.
_BLOCK_18K: Final = {(512 << k, bits): 1.0 for k, bits in enumerate((36, 18, 9, 4, 2, 1))}
#: Command of yosys. The scheduler never reads a register in the cycle in which it is written, and
#: the bank of results that is written is not read: these memories need no logic for the old word.
_NO_RW_CHECK: Final = "setattr -set no_rw_check 1 *operands*/m:* *results*/m:*; "


def _parts(family: str, grades: tuple[int, ...], **units: str) -> tuple[Device, ...]:
    """The parts of a family, small first: rows of ``parts.csv``, with the number of each unit."""
    table = Path(__file__).with_name("parts.csv").read_text(encoding="utf-8")
    return tuple(
        Device(
            name=row["name"],
            resources={key: (int(row[key]), unit) for key, unit in units.items()},
            grades=grades,
            memory="ramb16" if "ramb16" in units else "ram",
        )
        for row in csv.DictReader(table.splitlines())
        if row["family"] == family
    )


def _each(use: Mapping[str, float], *names: str) -> dict[str, Mapping[str, float]]:
    """Types of cells with the same use of resources."""
    return dict.fromkeys(names, use)


#: No open tool routes it: its clock is an estimate. No latches, and no flip-flops on the falling
#: edge of the clock.
SPARTAN6: Final = Family(
    name="spartan6",
    title="Xilinx Spartan-6",
    synthesis="synth_xilinx -family xc6s -flatten -noiopad",
    cells={
        **_each({"lut": 1}, *(f"LUT{inputs}" for inputs in (1, 2, 3, 4, 5, 6, "6_2"))),
        **_each({"lut": 1}, "INV"),  # one that is left feeds no LUT: it takes one
        **_each({"lut": 1, "lut_ram": 1}, "SRL16E", "SRLC16E", "SRLC32E"),
        **_each({"lut": 1, "lut_ram": 1}, "RAM16X1S", "RAM32X1S", "RAM64X1S"),
        **_each({"lut": 2, "lut_ram": 2}, "RAM128X1S", "RAM16X1D", "RAM32X1D", "RAM64X1D"),
        **_each({"lut": 4, "lut_ram": 4}, "RAM256X1S", "RAM128X1D", "RAM32M", "RAM64M"),
        **_each({"ff": 1}, "FDRE", "FDSE", "FDCE", "FDPE"),
        **_each({}, "MUXF7", "MUXF8", "GND", "VCC"),
        "CARRY4": {"carry4": 1},
        "DSP48A1": {"dsp": 1},
        "RAMB16BWER": {"ramb16": 1},
        "RAMB8BWER": {"ramb16": 0.5},
        "BUFG": {"bufg": 1},
    },
    devices=_parts(
        "spartan6",
        (2, 3),
        lut="LUT6",
        ff="flip-flop",
        dsp="DSP48A1",
        ramb16="RAMB16, block RAM of 18 Kbit",
        lut_ram="LUT6 used as memory or shift register",
        carry4="CARRY4",
        bufg="BUFG",
    ),
    # RAMB16 and its halves.
    memory_shapes=_BLOCK_18K | {(words // 2, bits): 0.5 for words, bits in _BLOCK_18K},
    estimate=estimate_clock,
)


def _ecp5_memory(ports: str, *, wide: bool) -> Absorption:
    """The output registers of DP16KD: 36 bits are written by A and read by B, on both outputs."""
    return Absorption(
        cell="DP16KD",
        pins=tuple(f"DO{port}" for port in ports),
        register=(f"REGMODE_{ports[-1]}", "NOREG", "OUTREG"),
        parameters={f"REGMODE_{port}": "OUTREG" for port in ports},
        clock=f"CLK{ports[-1]}",
        enables=tuple(f"OCE{port}" for port in ports),
        agrees=f"CE{ports[-1]}",
        output=True,
        applies=lambda p: (int(p.get("DATA_WIDTH_B", "10010"), 2) == 36) == wide,
    )


def _ecp5_multiplier(pins: str, register: str, *, output: bool = False) -> Absorption:
    return Absorption(
        cell="MULT18X18D",
        pins=(pins,),
        register=(f"{register}_CLK", "NONE", "CLK0"),
        parameters={f"{register}_CE": "CE0", f"{register}_RST": "RST0", "GSR": "DISABLED"},
        clock="CLK0",
        enables=("CE0",),
        output=output,
        wires={"RST0": "0"},
    )


#: LUT4 and slices of two; CCU2C is two of their LUTs, PFUMX and L6MUX21 are beside them. What the
#: tool says of a part is all that can be used: of the 85k's 83,640 and so on.
ECP5: Final = Family(
    name="ecp5",
    title="Lattice ECP5",
    # A word leaves the block RAM after 5.8 ns, so memories of up to 64 words may become tables. A
    # reset that waits for the enable would be the enable, late as it is, and one more table on the
    # way to LSR: such resets become logic in front of the data. A net takes about 1 ns as routed;
    # with this instead of synth_ecp5's 0.3 ns abc9 makes fewer levels.
    synthesis=_NO_RW_CHECK + "synth_ecp5 -run :map_ram; "
    "setattr -unset ram_style t:$mem_v2 r:SIZE<=64 %i; synth_ecp5 -run map_ram:map_ffs; "
    "dffunmap -srst-only t:$sdffce t:$_SDFFCE_*; synth_ecp5 -run map_ffs:map_luts; "
    "techmap -map +/lattice/latches_map.v; abc9 -W 1000; clean; synth_ecp5 -run map_cells:",
    cells={
        "LUT4": {"lut": 1},
        "CCU2C": {"lut": 2},
        "TRELLIS_DPR16X4": {"lut": 6},
        "TRELLIS_FF": {"ff": 1},
        "MULT18X18D": {"dsp": 1},
        "DP16KD": {"ram": 1},
        **_each({}, "PFUMX", "L6MUX21", "EHXPLLL", "DCCA", "TRELLIS_IO", "SGSR"),
    },
    flip_flops=(
        FlipFlop(
            kind="TRELLIS_FF",
            d="DI",
            enable="CE",
            reset="LSR",
            parameters={"CEMUX": "1 ", "GSR": "DISABLED"},
            plain={"LSRMUX": "LSR", "REGSET": "RESET", "CLKMUX": "CLK"},
        ),
    ),
    devices=_parts(
        "ecp5",
        (6, 7, 8),
        lut="LUT4",
        ff="flip-flop",
        dsp="MULT18X18D",
        ram="DP16KD, block RAM of 18 Kbit",
    ),
    memory_shapes=_BLOCK_18K,
    # docs/targets.md#measured has the commands.
    clocks={
        **{(1, 7): 79.4, (1, 9): 129.5, (1, 10): 132.4, (1, 12): 147.1},
        **{(2, 9): 104.4, (2, 10): 115.7},
    },
    clocks_source="clocks of four filters routed on ecp5-25k, speed 6, 1 to 5 seeds",
    router=Router(
        program="nextpnr-ecp5",
        extra="ecp5",
        options=("--{size}", "--package", "CABGA381", "--speed", "{grade}", "--tmg-ripup"),
        pins=("--lpf", "top.lpf"),
        placed=("--textcfg", "top.config"),
        packer=("ecppack", "--compress"),
        bitstream="top.bit",
    ),
    registers=(
        _ecp5_memory("AB", wide=True),
        _ecp5_memory("A", wide=False),
        _ecp5_memory("B", wide=False),
        _ecp5_multiplier("A", "REG_INPUTA"),
        _ecp5_multiplier("B", "REG_INPUTB"),
        _ecp5_multiplier("P", "REG_OUTPUT", output=True),
    ),
)

#: Yosys itself uses the registers of its multipliers.
ICE40: Final = Family(
    name="ice40",
    title="Lattice iCE40 UltraPlus",
    synthesis="setattr -set no_rw_check 1 *operands*/m:*; synth_ice40 -device u -dsp",
    cells={
        "SB_LUT4": {"lut": 1},
        **{
            f"SB_DFF{edge}{enable}{reset}": {"ff": 1}
            for edge, enable, reset in product(("", "N"), ("", "E"), ("", "SR", "R", "SS", "S"))
        },
        "SB_MAC16": {"dsp": 1},
        "SB_RAM40_4K": {"ram": 1},
        "SB_SPRAM256KA": {"spram": 1},
        **_each({}, "SB_CARRY", "SB_IO", "SB_GB_IO", "SB_PLL40_PAD"),
    },
    flip_flops=(FlipFlop(kind="SB_DFF", clock="C"),),
    devices=_parts(
        "ice40",
        (1,),
        lut="LUT4",
        ff="flip-flop",
        dsp="SB_MAC16",
        ram="SB_RAM40_4K, block RAM of 4 Kbit",
        spram="SB_SPRAM256KA",
    ),
    memory_shapes={(256 << k, 16 >> k): 1 for k in range(4)},
    router=Router(
        program="nextpnr-ice40",
        extra="ice40",
        options=("--{size}", "--package", "sg48"),
        pins=("--pcf", "top.pcf"),
        placed=("--asc", "top.asc"),
        packer=("icepack",),
        bitstream="top.bin",
    ),
)


#: CrossLink-NX and Certus-NX. WIDEFN9 is two LUT4 and a multiplexer, CCU2 two and a carry, DPR16X4
#: four and the two of its write port. The output registers of memories stay unused: what enables
#: them neither yosys nor nextpnr says.
NEXUS: Final = Family(
    name="nexus",
    title="Lattice Nexus",
    # Multipliers are mapped before synth_nexus: its pass that uses their registers (yosys 0.70,
    # lattice_dsp_nexus) connected an operand of one of a core's four to 0.
    synthesis="proc; wreduce t:$mul; techmap -map +/mul2dsp.v -D DSP_A_MAXWIDTH=18 "
    "-D DSP_B_MAXWIDTH=18 -D DSP_NAME=$__NX_MUL18X18 t:$mul; "
    "techmap -map +/lattice/dsp_map_nexus.v t:$__NX_MUL18X18; "
    + _NO_RW_CHECK
    + "synth_nexus -noiopad",
    cells={
        **_each({"lut": 1}, "LUT4", "INV"),
        **_each({"lut": 2}, "WIDEFN9", "CCU2"),
        "DPR16X4": {"lut": 6},
        **_each({"ff": 1}, *(f"FD1P3{kind}X" for kind in "BDIJ")),
        **_each({"dsp": 0.5}, "MULT9X9", "MULTPREADD9X9"),
        **_each({"dsp": 1}, "MULT18X18", "MULTPREADD18X18", "MULTADDSUB18X18"),
        **_each({"dsp": 2}, "MULT18X36", "MULTADDSUB9X9WIDE"),
        **_each({"dsp": 4}, "MULT36X36", "MULTADDSUB36X36"),
        **_each({"ram": 1}, "DP16K", "PDP16K", "PDPSC16K"),
        **_each({}, "VHI", "VLO"),
    },
    flip_flops=(
        FlipFlop(
            kind="FD1P3IX", clock="CK", enable="SP", reset="CD", parameters={"GSR": "DISABLED"}
        ),
    ),
    drivers={"clk": ("DCC", {}, "CLKO"), "0": ("VLO", {}, "Z")},
    devices=_parts(
        "nexus",
        (7, 8, 9),
        lut="LUT4",
        ff="flip-flop",
        dsp="MULT18X18",
        ram="EBR, block RAM of 18 Kbit",
    ),
    memory_shapes=_BLOCK_18K,
    # docs/targets.md#measured has the commands.
    clocks={(1, 7): 110.4, (1, 9): 154.8},
    clocks_source="clocks of four filters routed on lifcl-17, speed 7, 3 seeds",
    # With --tmg-ripup and a clock that is not reached the router did not end (135 rounds).
    router=Router(
        program="nextpnr-nexus", extra="nexus", options=("--device", "{name}-{grade}BG256C")
    ),
    registers=tuple(
        Absorption(
            cell="MULT18X18",
            pins=(pins,),
            register=(register, "BYPASS", "REGISTER"),
            enables=(f"CE{suffix}",),
            output=pins == "Z",
            idle=(f"RST{suffix}",),
        )
        for pins, register, suffix in (
            ("A", "REGINPUTA", "A"),
            ("B", "REGINPUTB", "B"),
            ("Z", "REGOUTPUT", "OUT"),
        )
    ),
    constants={"VLO": ("Z", "0"), "VHI": ("Z", "1")},
    # The input of the first cell of a carry chain comes from the chain beside it, so that nextpnr
    # takes no driver there; the cell does not read it. abc9 ties what is open to 0
    # (github.com/YosysHQ/yosys/issues/5639).
    opens={"CCU2": ("INIT1", "0x00AA", "CIN")},
)


ARTIX7: Final = Family(
    name="artix7",
    title="Xilinx Artix-7",
    synthesis=_NO_RW_CHECK + "synth_xilinx -family xc7 -flatten -noiopad -noclkbuf",
    cells={
        **_each({"lut": 1}, "INV", "SRL16E", "SRLC32E", *(f"LUT{n}" for n in range(1, 7))),
        **_each({"lut": 2}, "RAM32X1D", "RAM64X1D"),
        **_each({"lut": 4}, "RAM32M", "RAM64M", "RAM128X1D"),
        **_each({}, "CARRY4", "MUXF7", "MUXF8"),
        **_each({"ff": 1}, "FDRE", "FDSE", "FDCE", "FDPE"),
        "DSP48E1": {"dsp": 1},
        "RAMB18E1": {"ram": 0.5},
        "RAMB36E1": {"ram": 1},
    },
    devices=_parts(
        "artix7",
        (1,),
        lut="LUT6",
        ff="flip-flop",
        dsp="DSP48E1",
        ram="RAMB36E1, block RAM of 36 Kbit",
    ),
    memory_shapes=dict.fromkeys(_BLOCK_18K, 0.5),
)
#: Two tables of up to 5 inputs fit into an ALM, as far as they share inputs; one of 6. A DSP block
#: has three multipliers of 9 bits, two of 18 or one of 27.
CYCLONE5: Final = Family(
    name="cyclone5",
    title="Intel Cyclone V",
    synthesis=_NO_RW_CHECK + "synth_intel_alm -noiopad -noclkbuf -nolutram",
    cells={
        **_each({"lut": 0.5}, *(f"MISTRAL_ALUT{inputs}" for inputs in range(2, 6))),
        **_each({"lut": 0.5}, "MISTRAL_NOT", "MISTRAL_ALUT_ARITH"),
        "MISTRAL_ALUT6": {"lut": 1},
        "MISTRAL_FF": {"ff": 1},
        "MISTRAL_MUL9X9": {"dsp": 1 / 3},
        "MISTRAL_MUL18X18": {"dsp": 0.5},
        "MISTRAL_MUL27X27": {"dsp": 1},
        "MISTRAL_M10K": {"ram": 1},
    },
    devices=_parts(
        "cyclone5", (8,), lut="ALM", ff="flip-flop", dsp="variable-precision DSP block", ram="M10K"
    ),
    memory_shapes={(256 << k, bits): 1 for k, bits in enumerate((40, 20, 10, 5, 2, 1))},
)

#: Targets by name; the slowest grade has no number in its name.
TARGETS: Final = {
    target.name: target
    for family in (SPARTAN6, ECP5, ICE40, NEXUS, ARTIX7, CYCLONE5)
    for device in family.devices
    for k, grade in enumerate(device.grades)
    for target in [Target(f"{device.name}-{grade}" if k else device.name, family, device, grade)]
}
