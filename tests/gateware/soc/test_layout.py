"""The header agrees with the table, and C takes it."""

import re
import subprocess

from boresight.gateware.soc.layout import (
    CONTROL,
    CONTROL_BASE,
    INTERRUPTS,
    KICK,
    SLOT_BASE,
    soc_header,
)


def test_header_has_every_register_and_bit() -> None:
    defined = dict(re.findall(r"(?m)^#define SOC_(\w+) (\S+)", soc_header()))
    assert int(defined["CONTROL_BASE"][9:-1], 16) == CONTROL_BASE
    assert int(defined["SLOT_BASE"][9:-1], 16) == SLOT_BASE
    assert int(defined["WATCHDOG_KICK"][9:-1], 16) == KICK
    for address, register in enumerate(CONTROL):
        assert int(defined[f"{register.name.upper()}_ADDR"]) == address
        for k, bit in enumerate(register.bits):
            text = defined[f"{register.name.upper()}_{bit.upper()}"]
            assert int(text[9:-1], 16) == 1 << k
    for k, name in enumerate(INTERRUPTS):
        assert int(defined[f"INTERRUPT_{name.upper()}"][9:-1], 16) == 1 << k


def test_c_takes_it(tmp_path) -> None:
    (tmp_path / "soc_registers.h").write_text(soc_header())
    (tmp_path / "x.c").write_text(
        '#include <stdint.h>\n#include "soc_registers.h"\n'
        "int main(void) { return SOC_STATUS_DEVICE != 0; }\n"
    )
    subprocess.run(
        ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "x.c", "-o", "x"],
        cwd=tmp_path,
        check=True,
    )


def test_registers_fit_their_addresses() -> None:
    assert len(CONTROL) <= 8
    assert len({r.name for r in CONTROL}) == len(CONTROL)
