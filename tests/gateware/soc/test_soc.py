"""The parts' arguments, and that the system is one that the part can hold by itself."""

import sys

import pytest

from boresight.gateware.soc import cpu
from boresight.gateware.soc.cpu import cpu_verilog
from boresight.gateware.soc.memory import Ram
from boresight.gateware.soc.system import Soc, soc_verilog
from boresight.model.errors import ToolMissing


def test_verilog_of_all_parts() -> None:
    files = soc_verilog(Soc(words=1024, divisor=8))
    assert list(files) == ["soc.v", "ram.v", "VexRiscv.v"]
    for name, module in (("soc.v", "soc"), ("ram.v", "boresight_ram"), ("VexRiscv.v", "VexRiscv")):
        assert f"module {module}" in files[name]
    assert '.IMAGE("firmware.hex")' in files["soc.v"]


@pytest.mark.parametrize("words", [0, 100, 255, 65536 + 256])
def test_memory_sizes(words: int) -> None:
    with pytest.raises(ValueError, match="^words must be a multiple of 256 up to 65536, not"):
        Ram(words=words)


def test_missing_package_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cpu, "_PACKAGE", "no_such_package")
    with pytest.raises(
        ToolMissing,
        match=r"^the soft core was not found: run 'pip install "
        r"pythondata-cpu-vexriscv' in this Python env\w+$",
    ):
        cpu_verilog()
    assert "no_such_package" not in sys.modules
