"""Update controller and engine: samples in, results out."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.core import Core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.system.conductor import Conductor
from boresight.gateware.system.programs import core_plan

__all__ = ["AttitudeCore"]

#: Members of the conductor that are not ports.
_INSIDE = ("i", "o", "choice", "chosen", "framing", "saturated")


class AttitudeCore(wiring.Component):
    """A system's core with its update controller.

    **Latency** `Conductor.latency`.

    Parameters
    ----------
    core : Core
        Core of `gateware.system.programs.system_core`.
    readers : int
        Readers of the results.

    Members
    -------
    All of the `Conductor` except its connection to the core, and

    bus : In(BusSignature)
        The core's registers: parameters and status. The program is not chosen here.
    """

    def __init__(self, *, core: Core, readers: int = 2) -> None:
        self.core = core
        self.conductor = Conductor(plan=core_plan(core), readers=readers)
        members = {
            name: member
            for name, member in self.conductor.signature.members.items()
            if name not in _INSIDE
        }
        word = core.machine.arithmetic.word
        super().__init__({**members, "bus": In(BusSignature(word=word))})

    def elaborate(self, platform: Any) -> Module:
        """Connect controller and engine."""
        m = Module()
        m.submodules.conductor = conductor = self.conductor
        m.submodules.engine = engine = Engine(
            machine=self.core.machine, image=self.core.image, selector=True
        )
        wiring.connect(m, conductor.i, engine.i)
        wiring.connect(m, engine.o, conductor.o)
        wiring.connect(m, wiring.flipped(self.bus), engine.bus)
        m.d.comb += [
            engine.choice.eq(conductor.choice),
            conductor.chosen.eq(engine.chosen),
            conductor.framing.eq(engine.framing),
            conductor.saturated.eq(engine.saturated_update),
        ]
        for name, member in conductor.signature.members.items():
            if name in _INSIDE:
                continue
            mine, theirs = getattr(self, name), getattr(conductor, name)
            if name == "ports":
                for outer, port in zip(mine, theirs, strict=True):
                    wiring.connect(m, wiring.flipped(outer), port)
            elif member.flow is In:
                m.d.comb += theirs.eq(mine)
            else:
                m.d.comb += mine.eq(theirs)
        return m
