"""Memory map of the soft core, read by gateware, C header and documentation."""

from __future__ import annotations

from dataclasses import dataclass, field

from boresight.gateware.texts.render import render

#: Byte addresses. From 0x8000_0000 on the processor's caches are bypassed.
CONTROL_BASE = 0x8000_0000
SLOT_BASE = 0x8000_4000
#: Words of the slot for a device.
SLOT_WORDS = 4096
#: Word that restarts the watchdog's count.
KICK = 0x57A9


@dataclass(frozen=True)
class ControlRegister:
    """One word of the control block; ``bits`` by name, lowest first."""

    name: str
    meaning: str
    bits: dict[str, str] = field(default_factory=dict)


#: Registers of the control block, by word address.
CONTROL = (
    ControlRegister("cycles", "clock cycles since reset, modulo 2^32; read only"),
    ControlRegister(
        "alarm",
        "the timer interrupt is raised while cycles - alarm, as a signed "
        "number, is not negative and the timer is on",
    ),
    ControlRegister("timer", "timer interrupt on (1) or off (0), write only"),
    ControlRegister(
        "console",
        "byte: write sends it (lost unless CONSOLE_FREE), read gives the "
        "last one received and clears CONSOLE_FULL",
    ),
    ControlRegister(
        "status",
        "conditions; write 1 to clear the sticky ones",
        {
            "console_free": "a byte may be sent",
            "console_full": "a byte has been received",
            "console_lost": "sticky: a received byte was lost or had no stop bit",
            "bus_error": "sticky: access to no device, or write to protected memory",
            "watchdog_fired": "sticky: the watchdog has restarted the processor",
            "device": "sticky: the device in the slot has asked",
        },
    ),
    ControlRegister("watchdog", f"write {KICK:#x} in time, or the processor restarts"),
    ControlRegister(
        "fence",
        "write only: 1 KB pages of memory below this number can no longer be "
        "written; a smaller number has no effect",
    ),
)

#: Bits of the interrupt array, lowest first, and what raises them.
INTERRUPTS = {
    "device": "the status bit of this name",
    "console": "a byte has been received: the status bit console_full",
    "bus_error": "the status bit of this name",
}


def soc_header() -> str:
    """C99 header with the memory map."""
    return render(
        "soc_registers.h",
        control_base=CONTROL_BASE,
        slot_base=SLOT_BASE,
        slot_words=SLOT_WORDS,
        kick=KICK,
        control=CONTROL,
        interrupts=INTERRUPTS,
    )
