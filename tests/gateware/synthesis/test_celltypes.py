"""The sorts of primitives do not overlap, and each has both area and timing."""

from itertools import combinations

import pytest

from boresight.gateware.synthesis import celltypes as ct
from boresight.gateware.synthesis.area import count_area
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import NetlistError

SORTS = [
    ct.LUTS,
    ct.FLIP_FLOPS,
    ct.LATCHES,
    ct.SHIFT_REGISTERS,
    set(ct.LUTRAMS),
    set(ct.BLOCK_RAMS),
    ct.SPECIALS,
]
NO_TIMING = ct.LATCHES | {name for name in ct.FLIP_FLOPS if name.endswith("_1")}


def test_sorts_are_disjoint():
    assert all(not set(a) & set(b) for a, b in combinations(SORTS, 2))


@pytest.mark.parametrize("name", sorted(set().union(*SORTS)))
def test_every_type_is_counted_and_timed_or_refused(tiny, name):
    net = tiny.add(name, "u").netlist()
    assert count_area(net).cells == {name: 1}
    if name in NO_TIMING:
        with pytest.raises(NetlistError, match="for timing, not"):
            build_graph(net)
    else:
        build_graph(net)


def test_unknown_cell_message():
    error = ct.UnknownCell(cell="u1", type="EHXPLLL", use="area")
    assert str(error) == (
        "cell type must be a Spartan-6 primitive with area data, not 'EHXPLLL' (cell u1)"
    )
