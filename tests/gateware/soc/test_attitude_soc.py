"""System and soft core together: which pins, and that one without Wishbone is refused."""

import pytest

from boresight.gateware.soc.attitude_soc import CONSOLE, AttitudeSoc
from boresight.gateware.system.attitude_system import AttitudeSystem
from boresight.gateware.system.programs import system_core
from boresight.gateware.verilog import to_verilog


@pytest.fixture(scope="module")
def core():
    return system_core(("complementary",))


def test_needs_the_wishbone(core) -> None:
    with pytest.raises(ValueError, match="^system must be made with wishbone=True, not without$"):
        AttitudeSoc(system=AttitudeSystem(core=core))


def test_pins(core) -> None:
    system = AttitudeSystem(core=core, wishbone=True)
    dut = AttitudeSoc(system=system, words=1024)
    assert dut.lines == (*system.lines, *CONSOLE)
    for line in dut.lines:
        assert line.name in dut.signature.members
    assert "wb" not in dut.signature.members
    text = to_verilog(dut, "attitude_soc", instances=True)
    head = text[text.index("module attitude_soc(") :]
    head = head[: head.index(";")]
    for line in dut.lines:
        assert line.name in head
    assert "DSP48A1" in text and "VexRiscv" in text and "boresight_ram" in text
