"""The complete system as a component: its registers, its events, its identity."""

import pytest

from boresight.gateware.attitude.sensors.adis16385 import Adis16385, Timing
from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem, system_design
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.core import Core
from boresight.model.errors import InputError


@pytest.fixture(scope="module")
def core() -> Core:
    """One filter."""
    return system_core(("complementary",))


def test_identity_follows_programs_and_configuration(core: Core) -> None:
    builds = {
        AttitudeSystem(core=core, **options).build
        for options in (
            {},
            {"clock_hz": 50e6},
            {"host_baud": 115_200},
            {"inertial": Adis16385(clock_hz=100e6, timing=Timing(stall_s=20e-6))},
            {"compass": Hmr3300(clock_hz=100e6, baud=9600)},
        )
    }
    assert len(builds) == 5
    assert AttitudeSystem(core=core).build in builds


def test_a_clock_that_no_line_can_use(core: Core) -> None:
    with pytest.raises(InputError, match="clock: wanted a clock from which both serial rates"):
        system_design(core, 3_000_000)


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
