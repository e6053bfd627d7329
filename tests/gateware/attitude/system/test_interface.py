"""The declaration of the system: one map, the places of the hardware, and every written form."""

import pytest

from boresight.gateware.attitude.system.interface import system_map, system_registers
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.attitude.system.system_bus import CSR
from boresight.gateware.core import Core
from boresight.gateware.description import Description

FILTERS = ("complementary", "ekf_quaternion")
EVENTS = ("sample", "restart")


@pytest.fixture(scope="module")
def core() -> Core:
    return system_core(FILTERS)


@pytest.fixture(scope="module")
def whole(core: Core) -> Description:
    registers = system_registers(
        filters=FILTERS,
        clock_hz=100e6,
        build=0xFEDC_BA98_7654_3210,
        inertial_flags={"running": "it runs", "alarm": "it has an alarm"},
        compass_flags={"stale": "old"},
    )
    return system_map(core, registers=registers, events=EVENTS)


def test_no_address_and_no_name_twice(whole: Description) -> None:
    for key in ("address", "name"):
        values = [getattr(r, key) for r in whole.registers]
        assert len(values) == len(set(values)), key
    assert len(whole.identifiers) == len(whole.registers)


#: Settings after power-up, by register.
SETTINGS = {
    "inertial_msc_ctrl": 0x0006,
    "inertial_smpl_prd": 0x0001,
    "inertial_sens_avg": 0x0402,
    "magnetic_source": 2,
    "compass_mode": 1,
    "output_mode": 1,
    "output_divider": 8,
}


@pytest.mark.parametrize("name", SETTINGS)
def test_a_setting_is_its_registers_word_after_power_up(whole: Description, name: str) -> None:
    assert whole.find(name).reset == SETTINGS[name]


def declared(**more):
    options = {"clock_hz": 1e8, "build": 0, "inertial_flags": {}, "compass_flags": {}, **more}
    return {r.name: r for r in system_registers(**{"filters": ("one", "two"), **options})}


def test_what_a_system_has_not_is_not_there() -> None:
    usual, other = declared(), declared(feed=True)
    orders = [f.name for f in usual["order"].fields]
    assert orders == ["restart_filter", "restart_inertial", "clear_counters"]
    assert [f.name for f in other["order"].fields] == [*orders, "take_feed"]
    assert (usual["order"].width, other["order"].width) == (3, 4)
    assert {n: r.address for n, r in usual.items()} == {n: r.address for n, r in other.items()}
    assert usual["identification"].address == CSR
