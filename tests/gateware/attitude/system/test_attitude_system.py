"""The complete system as a component: its registers, its events, its identity."""

import pytest
from amaranth.back import rtlil

from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.adis16385_device import Timing
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem, system_design
from boresight.gateware.attitude.system.interface import system_registers
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.attitude.system.system_bus import CSR
from boresight.gateware.core import Core
from boresight.model.errors import InputError


@pytest.fixture(scope="module")
def core() -> Core:
    """One filter."""
    return system_core(("complementary",))


def test_registers_are_told_apart(core: Core) -> None:
    whole = AttitudeSystem(core=core).map()
    registers = whole.registers
    assert len({r.address for r in registers}) == len({r.name for r in registers}) == len(registers)
    assert len(whole.identifiers) == len(registers)
    names = {r.name for r in registers}
    assert {
        "calibrate_inertial.gyro_xx",
        "complementary.kp_roll_per_s",
        "result_heading",
        "count_inertial_sample",
        "count_bad_address",
        "temperature",
        "status",
    } <= names


def test_events_have_names_of_their_own(core: Core) -> None:
    system = AttitudeSystem(core=core)
    assert len(set(system.events)) == len(system.events) == len(system.probe_events)


def test_identity_follows_programs_and_configuration(core: Core) -> None:
    builds = {
        AttitudeSystem(core=core, **options).build
        for options in (
            {},
            {"clock_hz": 50e6},
            {"host_baud": 115_200},
            {"wishbone": True},
            {"inertial": Adis16385(clock_hz=100e6, timing=Timing(stall_s=20e-6))},
            {"compass": Hmr3300(clock_hz=100e6, baud=9600)},
        )
    }
    assert len(builds) == 6
    assert AttitudeSystem(core=core).build in builds


def test_with_wishbone_it_elaborates(core: Core) -> None:
    text = rtlil.convert(AttitudeSystem(core=core, wishbone=True), emit_src=False)
    assert "\\wb__ack" in text and "\\interrupt" in text
    assert "\\wb__ack" not in rtlil.convert(AttitudeSystem(core=core), emit_src=False)


def test_latency_is_the_sum_of_its_parts(core: Core) -> None:
    system = AttitudeSystem(core=core)
    core_cycles = system._attitude.latency(0)
    assert system.latency_cycles(0) == system.transfer_cycles + core_cycles
    assert system.latency_cycles(0) <= system.transfer_cycles + system.plan.lengths[0] + 100


def test_lines_are_ports(core: Core) -> None:
    system = AttitudeSystem(core=core)
    for line in system.lines:
        assert getattr(system, line.name).shape().width == 1
    assert {line.name for line in system.lines if line.input} == {
        "host_rx",
        "adis_miso",
        "adis_data_ready",
        "hmr_rx",
    }


def test_only_32_bit_words() -> None:
    narrow = system_core(("complementary",), word=30)
    with pytest.raises(InputError, match="wanted 32 bits for a complete system, found 30"):
        system_design(narrow)


def test_a_clock_that_no_line_can_use(core: Core) -> None:
    with pytest.raises(InputError, match="clock: wanted a clock from which both serial rates"):
        system_design(core)(3_000_000)


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


def test_settings_after_power_up(core: Core) -> None:
    system = AttitudeSystem(core=core).map()
    assert {name: system.find(name).reset for name in SETTINGS} == SETTINGS


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
