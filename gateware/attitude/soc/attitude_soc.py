"""The attitude system with a soft core beside it: hardware and software on the same samples."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.soc.system import Soc
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.boards.board import Line
from boresight.gateware.boards.uart import divisor_for

__all__ = ["CONSOLE", "RAM_WORDS", "AttitudeSoc"]

#: Words of memory that the XC6SLX9 has room for beside a core with all four filters: 12 KB. Beside
#: one with `mekf` alone it is 28 KB (`docs/decisions/0010-soft-core.md`).
RAM_WORDS = 3072

#: The soft core's own serial line.
CONSOLE = (
    Line(
        "console_rx",
        "console_rx",
        "to the soft core: TXD of a 3.3 V serial adapter",
        input=True,
        pull_up=True,
    ),
    Line("console_tx", "console_tx", "from the soft core: RXD of the adapter"),
)


class AttitudeSoc(wiring.Component):
    """`AttitudeSystem`, its registers in the slot of a `Soc`, its updates as the interrupt.

    The attitude system is independent of the software.

    Parameters
    ----------
    system : AttitudeSystem
        Made with ``wishbone``.
    console_baud : float
        Line of the soft core's console.
    words, watchdog_cycles, image
        See `Soc`.

    Members
    -------
    Those of `AttitudeSystem` other than the Wishbone, and `CONSOLE`.
    """

    def __init__(
        self,
        *,
        system: AttitudeSystem,
        console_baud: float = 115_200,
        words: int = RAM_WORDS,
        watchdog_cycles: int = 1 << 24,
        image: str = "firmware.hex",
    ) -> None:
        if not system.wishbone:
            raise ValueError("system must be made with wishbone=True, not without")
        self.system = system
        self.soc = Soc(
            words=words,
            watchdog_cycles=watchdog_cycles,
            image=image,
            divisor=divisor_for(clock_hz=system.clock_hz, baud=console_baud),
        )
        self.lines = (*system.lines, *CONSOLE)
        self.clock_hz = system.clock_hz
        self.title = "attitude system with a soft core"
        self.console_baud = console_baud
        self.words = words
        super().__init__(
            {
                **{
                    name: member
                    for name, member in system.signature.members.items()
                    if name not in ("wb", "interrupt")
                },
                "console_rx": In(1, init=1),
                "console_tx": Out(1, init=1),
            }
        )

    readme = "board_soc"

    def facts(self) -> dict[str, Any]:
        """Values of the system and the soft core for a project's README."""
        return {**self.system.facts(), "memory": 4 * self.words, "console_baud": self.console_baud}

    def elaborate(self, platform: Any) -> Module:
        """Connect the two parts."""
        m = Module()
        m.submodules.system = system = self.system
        m.submodules.soc = soc = self.soc
        wiring.connect(m, soc.slot, system.wb)
        m.d.comb += [
            soc.interrupt.eq(system.interrupt),
            soc.rx.eq(self.console_rx),
            self.console_tx.eq(soc.tx),
        ]
        for name, member in self.signature.members.items():
            if name in system.signature.members:
                inner, outer = getattr(system, name), getattr(self, name)
                m.d.comb += inner.eq(outer) if member.flow is In else outer.eq(inner)
        return m
