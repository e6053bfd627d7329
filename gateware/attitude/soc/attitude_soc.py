"""The attitude system with a soft core beside it."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.soc.system import Soc
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem


class AttitudeSoc(wiring.Component):
    """`AttitudeSystem` with its registers in the slot of a `Soc`.

    The attitude system does not depend on the software. The members are those of the system
    without its Wishbone, and the program's ``word`` and ``word_valid``.

    Parameters
    ----------
    system : AttitudeSystem
        Made with ``wishbone``.
    words : int
        Words of memory.
    """

    def __init__(self, *, system: AttitudeSystem, words: int) -> None:
        self.system, self.soc = system, Soc(words=words)
        members = system.signature.members
        self._members = {n: m for n, m in members.items() if n not in ("wb", "interrupt")}
        super().__init__({**self._members, "word": Out(32), "word_valid": Out(1)})

    def elaborate(self, platform: Any) -> Module:
        """Connect the two parts."""
        m = Module()
        m.submodules.system = system = self.system
        m.submodules.soc = soc = self.soc
        wiring.connect(m, soc.slot, system.wb)
        m.d.comb += [
            soc.updated.eq(system.interrupt),
            self.word.eq(soc.word),
            self.word_valid.eq(soc.word_valid),
        ]
        for name, member in self._members.items():
            inner, outer = getattr(system, name), getattr(self, name)
            m.d.comb += inner.eq(outer) if member.flow is In else outer.eq(inner)
        return m
