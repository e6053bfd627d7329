"""Update controller and engine: samples in, results out."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from boresight.gateware.attitude.bus.stream_buffer import StreamBuffer
from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.programs import core_plan
from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.core import Core
from boresight.gateware.engine.engine import Engine

__all__ = ["AttitudeCore"]

#: Members of the conductor that are not ports.
_INSIDE = ("i", "o", "choice", "chosen", "framing", "saturated")


class AttitudeCore(wiring.Component):
    """A system's core with its update controller.

    With a core whose memories have a register behind them (`Machine.has`), so have the results, and
    two words wait between controller and core.

    **Latency** `latency`.

    Parameters
    ----------
    core : Core
        Core of `gateware.attitude.system.programs.system_core`.
    readers : int
        Readers of the results.

    Members
    -------
    All of the `Conductor` except its connection to the core, and

    bus : In(BusSignature(word=W))
        The core's registers: parameters and status. The program is not chosen here. Writes take
        2 cycles more than those of a core, whose acknowledgement comes late in a cycle.
    """

    def __init__(self, *, core: Core, readers: int = 2) -> None:
        self.core = core
        #: Cycles to read a result.
        self.read_cycles = 2 if core.machine.has("memory") else 1
        self.conductor = Conductor(
            plan=core_plan(core), readers=readers, read_cycles=self.read_cycles
        )
        members = {
            name: member
            for name, member in self.conductor.signature.members.items()
            if name not in _INSIDE
        }
        word = core.machine.arithmetic.word
        super().__init__({**members, "bus": In(BusSignature(word=word))})

    def latency(self, number: int) -> int:
        """Cycles from ``sample`` to ``updated`` with this filter, see `Conductor.latency`.

        The buffer adds one for each program.
        """
        jobs = 1 + len(self.conductor.plan.chains[number])
        return self.conductor.latency(number) + (jobs if self.read_cycles == 2 else 0)

    def elaborate(self, platform: Any) -> Module:
        """Connect controller and engine."""
        m = Module()
        m.submodules.conductor = conductor = self.conductor
        m.submodules.engine = engine = Engine(
            machine=self.core.machine, image=self.core.image, selector=True
        )
        self._feed(m, conductor, engine)
        wiring.connect(m, engine.o, conductor.o)
        self._bus(m, engine)
        m.d.comb += [
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

    def _bus(self, m: Module, engine: Engine) -> None:
        """The core's registers: strobe and acknowledgement of a write through flip-flops."""
        bus, core = self.bus, engine.bus
        done = Signal()
        m.d.comb += [
            core.addr.eq(bus.addr),
            core.w_data.eq(bus.w_data),
            bus.r_data.eq(core.r_data),
            bus.w_ack.eq(done),
        ]
        m.d.sync += [core.w_stb.eq(bus.w_stb & ~core.w_ack & ~done), done.eq(core.w_ack)]

    def _feed(self, m: Module, conductor: Conductor, engine: Engine) -> None:
        """Words and choice of the program to the core, through a buffer or not."""
        if self.read_cycles == 1:
            wiring.connect(m, conductor.i, engine.i)
            m.d.comb += [engine.choice.eq(conductor.choice), conductor.chosen.eq(engine.chosen)]
            return
        m.submodules.words = words = StreamBuffer(layout=engine.i.payload.shape())
        wiring.connect(m, conductor.i, words.i)
        wiring.connect(m, words.o, engine.i)
        # Words of a record that wait are of the program chosen for them.
        choice = Signal.like(conductor.choice)
        same = Signal()  # as of the cycle before, like the engine's ``chosen``
        with m.If(words.empty):
            m.d.sync += choice.eq(conductor.choice)
        m.d.sync += same.eq(choice == conductor.choice)
        m.d.comb += [engine.choice.eq(choice), conductor.chosen.eq(engine.chosen & same)]
