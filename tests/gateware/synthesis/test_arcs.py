"""What cells say about timing uses only names that the delay tables have."""

from itertools import product

import pytest

from boresight.gateware.synthesis.arcs import CellTiming
from boresight.gateware.synthesis.celltypes import (
    BLOCK_RAMS,
    FLIP_FLOPS,
    LUTRAMS,
    LUTS,
    SHIFT_REGISTERS,
)
from boresight.gateware.synthesis.delays import delay_table
from boresight.gateware.synthesis.dsp_arcs import dsp_timing
from boresight.gateware.synthesis.graph import cell_timing
from boresight.gateware.synthesis.netlist import Cell

TABLE = delay_table(grade=2, nets="median")
REGISTERS = (
    "A0REG",
    "A1REG",
    "B0REG",
    "B1REG",
    "CREG",
    "DREG",
    "MREG",
    "PREG",
    "OPMODEREG",
    "CARRYINREG",
)


def names_in(timing: CellTiming) -> set[str]:
    records = [*timing.arcs, *timing.launches, *timing.setups, *timing.insides]
    return {key for record in records for key in record.keys}


def make(type_, params=None, inputs=None, outputs=None):
    wide = {p: tuple(range(100, 100 + n)) for p, n in (inputs or {}).items()}
    out = {p: tuple(range(500, 500 + n)) for p, n in (outputs or {}).items()}
    return Cell(name="u", type=type_, inputs=wide, outputs=out, params=params or {}, src="")


@pytest.mark.parametrize(
    "name",
    sorted(
        {
            *LUTS,
            *SHIFT_REGISTERS,
            *LUTRAMS,
            *BLOCK_RAMS,
            "INV",
            "CARRY4",
            "MUXF7",
            "MUXF8",
            "BUFG",
            *(f for f in FLIP_FLOPS if not f.endswith("_1")),
        }
    ),
)
def test_names_exist(name):
    pins = ("I0", "S", "A", "A0", "DPRA0", "ADDRA", "ADDRD", "D", "DIA", "WE", "CE", "CLKA")
    timing = cell_timing(
        make(name, inputs=dict.fromkeys(pins, 1), outputs={"O": 1, "Q": 1, "DOA": 1, "DPO": 1})
    )
    assert names_in(timing) <= set(TABLE)


@pytest.mark.parametrize("opmode", [None, "10010000", "10110000", "11110000", "00000000"])
def test_names_exist_for_every_choice_of_dsp_registers(opmode):
    inputs = {"A": 18, "B": 18, "C": 48, "D": 18, "PCIN": 48, "CARRYIN": 1, "OPMODE": 8}
    outputs = {"P": 48, "PCOUT": 48, "M": 36, "BCOUT": 18, "CARRYOUT": 1}
    seen = set()
    for values in product((0, 1), repeat=len(REGISTERS)):
        cell = make("DSP48A1", dict(zip(REGISTERS, values, strict=True)), inputs, outputs)
        if opmode is not None:
            cell.inputs["OPMODE"] = tuple(opmode)
            if opmode == "10010000" and not cell.params["PREG"]:
                continue  # an accumulator without a register is refused
        names = names_in(dsp_timing(cell))
        assert "" not in names
        seen |= names
    assert seen <= set(TABLE)
    if opmode is None:
        assert seen == {name for name in TABLE if name.startswith("dsp_")}, "a delay is never used"
