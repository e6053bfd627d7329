"""The registers of a complete system, declared once: hardware, files and host read this.

`system_registers` is the block that `gateware.bus.csr` makes; `gateware.system.system_map` is
everything on the bus.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from boresight.gateware.registers.model import Access, BitField, Register
from boresight.gateware.system.system_bus import CSR

__all__ = ["IDENTIFICATION", "VERSION", "system_registers"]

#: "BORE", and the version of this map: it changes when an address or a meaning does.
IDENTIFICATION, VERSION = 0x424F_5245, 1

_TAKE_FEED = "the feed registers' words, all together, from the next update on"

_READ, _WRITE, _BOTH = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE


def _flags(flags: Mapping[str, str]) -> tuple[BitField, ...]:
    return tuple(BitField(name, bit, text) for bit, (name, text) in enumerate(flags.items()))


def system_registers(
    *,
    filters: Sequence[str],
    clock_hz: float,
    build: int,
    inertial_flags: Mapping[str, str],
    compass_flags: Mapping[str, str],
    text: bool = True,
    feed: bool = False,
) -> tuple[Register, ...]:
    """Identification, state and settings of a system.

    Parameters
    ----------
    filters : sequence of str
        Names of the estimators, 1 to 8.
    clock_hz : float
        Clock, Hz.
    build : int
        Digest of programs and configuration; its low 64 bits are shown.
    inertial_flags, compass_flags : mapping
        Name and meaning of the readers' level flags, bit 0 first.
    text, feed : bool
        The output can be text; there are input registers.
    """
    if not 1 <= len(filters) <= 8:
        raise ValueError(f"filters must be 1 to 8, not {len(filters)}")
    rows = (
        *_identity(clock_hz, build),
        *_state(inertial_flags, compass_flags),
        *_modes(filters, text),
        *_sensors(),
        *_orders(feed),
    )
    return tuple(dataclasses.replace(row, address=CSR + row.address) for row in rows)


def _identity(clock_hz: float, build: int) -> tuple[Register, ...]:
    """What never changes."""
    return (
        Register(
            "identification",
            0,
            _READ,
            '"BORE" in ASCII, most significant byte first',
            width=32,
            reset=IDENTIFICATION,
        ),
        Register("map_version", 1, _READ, "version of this register map", width=32, reset=VERSION),
        Register(
            "clock_hz", 2, _READ, "clock of the system", unit="Hz", width=32, reset=round(clock_hz)
        ),
        Register(
            "system_build_low",
            3,
            _READ,
            "digest of programs and configuration, bits 31 to 0",
            width=32,
            reset=build & 0xFFFF_FFFF,
        ),
        Register(
            "system_build_high",
            4,
            _READ,
            "the same, bits 63 to 32",
            width=32,
            reset=build >> 32 & 0xFFFF_FFFF,
        ),
    )


def _state(
    inertial_flags: Mapping[str, str], compass_flags: Mapping[str, str]
) -> tuple[Register, ...]:
    """What the sensors say."""
    return (
        Register("time", 8, _READ, "clock cycles since power-up, modulo 2^32", width=32),
        Register(
            "inertial_flags",
            9,
            _READ,
            "state of the inertial sensor's reader",
            width=len(inertial_flags),
            fields=_flags(inertial_flags),
        ),
        Register(
            "compass_flags",
            10,
            _READ,
            "state of the compass's reader",
            width=len(compass_flags),
            fields=_flags(compass_flags),
        ),
        Register(
            "compass_x",
            11,
            _READ,
            "last good line of the compass: heading [0.1 deg], or "
            "magnetometer x [counts]; compass_flags says which",
            width=16,
            signed=True,
        ),
        Register(
            "compass_y",
            12,
            _READ,
            "the same line: pitch [0.1 deg], or magnetometer y [counts]",
            width=16,
            signed=True,
        ),
        Register(
            "compass_z",
            13,
            _READ,
            "the same line: roll [0.1 deg], or magnetometer z [counts]",
            width=16,
            signed=True,
        ),
        Register(
            "temperature",
            14,
            _READ,
            "of the inertial sensor: 25 degC + word * 0.0678 degC",
            unit="0.0678 degC",
            width=16,
            signed=True,
        ),
        Register(
            "diag_stat", 15, _READ, "DIAG_STAT of the inertial sensor, as last read", width=16
        ),
    )


def _modes(filters: Sequence[str], text: bool) -> tuple[Register, ...]:
    """What runs, and what is sent."""
    return (
        Register("run", 16, _BOTH, "samples go through the filter", width=1, reset=1),
        Register(
            "filter",
            17,
            _BOTH,
            "number of the filter, from the next sample on; a new filter restarts",
            width=max(1, (len(filters) - 1).bit_length()),
            reset=0,
            names=tuple(filters),
        ),
        Register(
            "magnetic_source",
            18,
            _BOTH,
            "lines of the compass that make the magnetic field",
            width=2,
            reset=2,
            names=("none", "counts", "heading", "any"),
        ),
        Register(
            "output_mode",
            19,
            _BOTH,
            "what is sent unasked",
            width=2,
            reset=1,
            names=("off", "binary", *(("text",) if text else ())),
        ),
        Register(
            "output_divider",
            20,
            _BOTH,
            "every n-th update is sent; 0 counts as 1",
            width=10,
            reset=8,
        ),
        Register(
            "results_hold",
            21,
            _BOTH,
            "1: the results stay those of one update, to be read "
            "together; 0: they are always the newest",
            width=1,
            reset=0,
        ),
    )


def _sensors() -> tuple[Register, ...]:
    """Settings of the sensors."""
    return (
        Register(
            "inertial_msc_ctrl",
            22,
            _BOTH,
            "MSC_CTRL of the inertial sensor, from its next restart on",
            width=16,
            reset=0x0006,
        ),
        Register("inertial_smpl_prd", 23, _BOTH, "SMPL_PRD, likewise", width=16, reset=0x0001),
        Register(
            "inertial_sens_avg",
            24,
            _BOTH,
            "SENS_AVG, likewise: bits 10:8 range, 2:0 filter",
            width=16,
            reset=0x0402,
        ),
        Register(
            "compass_mode",
            25,
            _BOTH,
            "sentences that the compass is told to send",
            width=2,
            reset=1,
            names=("as_it_is", "heading", "counts"),
        ),
    )


def _orders(feed: bool) -> tuple[Register, ...]:
    """What is done once."""
    return (
        Register(
            "order",
            26,
            _WRITE,
            "a 1 does it once",
            width=3 + feed,
            fields=(
                BitField("restart_filter", 0, "the next update restarts the filter"),
                BitField("restart_inertial", 1, "reset the inertial sensor and set it up again"),
                BitField("clear_counters", 2, "all counters to 0"),
                *((BitField("take_feed", 3, _TAKE_FEED),) if feed else ()),
            ),
        ),
        Register(
            "compass_command",
            27,
            _WRITE,
            "letter X of a command *X to the compass, in ASCII",
            width=8,
        ),
    )
