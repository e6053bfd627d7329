"""The system's own registers: their declaration."""

import pytest

from boresight.gateware.system.system_bus import CSR
from boresight.gateware.system.system_registers import system_registers


def registers(**more):
    given = {"clock_hz": 1e8, "build": 0, "inertial_flags": {}, "compass_flags": {}, **more}
    return {r.name: r for r in system_registers(**{"filters": ("one", "two"), **given})}


@pytest.mark.parametrize("count", [0, 9])
def test_filters_are_checked(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^filters must be 1 to 8, not {count}$"):
        registers(filters=("x",) * count)


def test_what_a_system_has_not_is_not_there() -> None:
    usual, other = registers(), registers(text=False, feed=True)
    assert usual["output_mode"].names == ("off", "binary", "text")
    assert other["output_mode"].names == ("off", "binary")
    orders = [f.name for f in usual["order"].fields]
    assert orders == ["restart_filter", "restart_inertial", "clear_counters"]
    assert [f.name for f in other["order"].fields] == [*orders, "take_feed"]
    assert (usual["order"].width, other["order"].width) == (3, 4)
    assert {n: r.address for n, r in usual.items()} == {n: r.address for n, r in other.items()}
    assert usual["identification"].address == CSR
