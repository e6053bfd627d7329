"""Register bus of the engine: status, identity, and the way to its parameters."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.machine import Machine

__all__ = ["Registers"]


class Registers(wiring.Component):
    """Status registers and parameter port.

    ::

        0..511  parameters, write only: a word of the register file (`Machine.parameter_address`).
                The write waits until the machine is idle; writes to states are ignored.
        512     status: bit 0 saturated, bit 1 framing (sticky, write 1 to clear), bit 2 idle,
                bit 3 parity
        513     completed updates, modulo 2^W
        514     build identifier, bits W-1:0
        515     build identifier, bits 2W-1:W
        516     number of the program that runs; a write waits as for parameters. Writes of numbers
                that no program has are ignored; with a selector, all are.

    With a ``selector`` the program is chosen not by the bus but by a port, without the bus.

    **Latency** 1 cycle for reading, 2 for writing to an idle machine.

    Parameters
    ----------
    machine : Machine
        Configuration.
    digest : int
        Build identifier.
    programs : int, >= 1
        Number of programs.
    selector : bool
        The program follows the port ``choice``.

    Members
    -------
    bus : In(BusSignature)
        The bus.
    request : Out(1), switch : Out(1)
        A word waits for the register file, or with ``switch`` for ``program``. Registered: what
        follows from it is the machine's clock enable.
    grant : In(1)
        It is written in this cycle.
    program : Out
        The program that runs.
    choice : In, chosen : Out(1)
        With a selector: the program that shall run, changed as by a write, at the next first word
        of a record; whether it did in the cycle before.
    saturated : In(1)
        A sticky result saturates in this cycle.
    framing : In(1)
        An update is abandoned with this cycle.
    commit : In(1)
        An update is complete with this cycle.
    idle, parity : In(1)
        For the status register.
    saturated_update : Out(1)
        The last completed update saturated.
    """

    def __init__(
        self, *, machine: Machine, digest: int, programs: int = 1, selector: bool = False
    ) -> None:
        if digest < 0:
            raise ValueError(f"digest must not be negative, not {digest!r}")
        if programs < 1:
            raise ValueError(f"programs must be 1 or more, not {programs!r}")
        self.machine = machine
        self.digest = digest
        self.programs = programs
        self.selector = selector
        choice = {"choice": In(range(programs)), "chosen": Out(1)} if selector else {}
        super().__init__(
            {
                "bus": In(BusSignature(word=machine.arithmetic.word)),
                "request": Out(1),
                "switch": Out(1),
                "grant": In(1),
                "program": Out(range(programs)),
                **choice,
                "saturated": In(1),
                "framing": In(1),
                "commit": In(1),
                "idle": In(1),
                "parity": In(1),
                "saturated_update": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Write decoding, flags, read multiplexer."""
        m = Module()
        bus, word = self.bus, self.machine.arithmetic.word
        fixed = bus.addr[9]
        waits = Signal()
        m.d.comb += [
            waits.eq(~fixed & ~self._of_state()),
            bus.w_ack.eq(bus.w_stb & (~waits | self.grant)),
        ]
        m.d.sync += self.request.eq(bus.w_stb & waits & ~self.grant)
        if self.selector:
            other = self.choice != self.program
            m.d.comb += bus.w_ack.eq(bus.w_stb & (~waits | self.grant & ~self.switch))
            m.d.sync += [
                self.request.eq((bus.w_stb & waits | other) & ~self.grant),
                self.switch.eq(other),
                self.chosen.eq(~other),
            ]
            with m.If(self.grant & self.switch):
                m.d.sync += self.program.eq(self.choice)
        elif self.programs > 1:
            # Without bit 8 of the address no other lane's bank is written either.
            with m.If(fixed & ~bus.addr[8] & (bus.addr[:3] == 4)):
                m.d.comb += waits.eq(bus.w_data < self.programs)
            m.d.sync += self.switch.eq(fixed)
            with m.If(self.grant & self.switch):
                m.d.sync += self.program.eq(bus.w_data)

        saturated, framing, updates = self._flags(m, bus.w_stb & fixed & ~bus.addr[:3].any())
        with m.Switch(bus.addr[:3]):
            with m.Case(0):
                m.d.sync += bus.r_data.eq(
                    saturated | framing << 1 | self.idle << 2 | self.parity << 3
                )
            with m.Case(1):
                m.d.sync += bus.r_data.eq(updates)
            with m.Case(2):
                m.d.sync += bus.r_data.eq(self.digest & ((1 << word) - 1))
            with m.Case(3):
                m.d.sync += bus.r_data.eq(self.digest >> word & ((1 << word) - 1))
            with m.Default():
                m.d.sync += bus.r_data.eq(self.program)
        return m

    def _of_state(self) -> Value:
        """The address is below the fixed ones, but none of a bank's lower half."""
        lower = self.machine.bank_depth // 2
        if lower == self.machine.bus_bank_words:
            return Const(0)
        return self.bus.addr[lower.bit_length() - 1]

    def _flags(self, m: Module, cleared: Value) -> tuple[Signal, Signal, Signal]:
        """Sticky flags, which a write clears, and the number of updates."""
        saturated, framing, pending = (Signal(name=n) for n in ("saturated", "framing", "pending"))
        updates = Signal(self.machine.arithmetic.word)
        with m.If(cleared):
            m.d.sync += [
                saturated.eq(saturated & ~self.bus.w_data[0]),
                framing.eq(framing & ~self.bus.w_data[1]),
            ]
        with m.If(self.saturated):
            m.d.sync += [saturated.eq(1), pending.eq(1)]
        with m.If(self.framing):
            m.d.sync += [framing.eq(1), pending.eq(0)]
        with m.If(self.commit):
            m.d.sync += [
                self.saturated_update.eq(pending | self.saturated),
                pending.eq(0),
                updates.eq(updates + 1),
            ]
        return saturated, framing, updates
