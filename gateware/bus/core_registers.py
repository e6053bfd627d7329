"""The register bus, and the registers of the engine on it: status, identity, parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import or_
from typing import Any

from amaranth.hdl import Const, Module, Signal, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware import registers
from boresight.gateware.machine import Machine


class BusSignature(wiring.Signature):
    """A small synchronous register bus, as its initiator sees it, with ``address`` bits."""

    def __init__(self, *, word: int, address: int = 10) -> None:
        super().__init__(
            {
                "addr": Out(address),  # Word address.
                "w_data": Out(word),  # Word to write.
                "w_stb": Out(1),  # Write; to be held with ``addr`` and ``w_data`` until ``w_ack``.
                "w_ack": In(1),  # The write is done with this cycle.
                "r_data": In(word),  # Word at the ``addr`` of the cycle before.
            }
        )


#: Bits of an address above the first fixed register's.
_OFFSET = (registers.RESTART.address - registers.FIRST).bit_length()


def layout_of(fields: Sequence[registers.BitField], *, width: int | None = None) -> data.Layout:
    """The layout of a register with these fields, ``width`` bits or up to the last of them."""
    size = width or max(field.bit + field.width for field in fields)
    members = {f.name: data.Field(f.width, f.bit) for f in fields}
    return data.FlexibleLayout(size, members)


class Registers(wiring.Component):
    """Status registers and parameter port.

    ::

        0..511  parameters, write only: a word of the register file (`Machine.parameter_address`).
                The write waits until the machine is idle; writes to states are ignored.
        512..   those of `gateware.registers`. A write of the program's number waits as for
                parameters. Writes of numbers that no program has are ignored; with a selector, all
                are.

    With a ``selector`` a port chooses the program instead of the bus. A program has to restart when
    it is first selected after a reset, and the selected one after ``restart`` or a write to
    `RESTART`. Then it does so as soon as it waits for a record.

    **Latency** 1 cycle for reading, 2 for writing to an idle machine.
    """

    def __init__(
        self, *, machine: Machine, digest: int, programs: int = 1, selector: bool = False
    ) -> None:
        self.machine = machine
        self.digest = digest
        self.programs = programs
        self.selector = selector
        choice = {"choice": In(range(programs)), "chosen": Out(1)} if selector else {}
        super().__init__(
            {
                "bus": In(BusSignature(word=machine.arithmetic.word)),
                # A word waits for the register file, or with ``switch`` for ``program``, or the
                # program has to restart. Registered: what follows from it is the clock enable.
                "request": Out(1),
                "switch": Out(1),
                "grant": In(1),  # The word is written in this cycle.
                "program": Out(range(programs)),  # Number of the selected program.
                # The program that shall run, changed as by a write, at the next first word of a
                # record; whether it did in the cycle before.
                **choice,
                "restart": In(1),  # The selected program has to restart.
                # The program begins; it has to restart, which is done with this cycle.
                "start": In(1),
                "anew": Out(1),
                "en": In(1),  # Clock enable of the machine.
                "saturated": In(1),  # With ``en``: a sticky result saturates in this cycle;
                "beyond": In(1),  # an input word is found beyond its range.
                "framing": In(1),  # Only with ``en``: an update is abandoned with this cycle;
                "commit": In(1),  # it is complete with it.
                "idle": In(1),  # This and the next are for the status register.
                "parity": In(1),
                # The last completed update saturated; had an input word beyond its range.
                "saturated_update": Out(1),
                "beyond_update": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        bus, word = self.bus, self.machine.arithmetic.word
        fixed, offset = bus.addr[registers.FIRST.bit_length() - 1], bus.addr[:_OFFSET]
        waits, inner = Signal(name="waits"), Signal(name="inner")
        other = self.choice != self.program if self.selector else Const(0)
        written = bus.w_stb & fixed & (offset == registers.RESTART.address - registers.FIRST)
        soon = self._restarts(m, self.restart | written)
        m.d.comb += [
            waits.eq(~fixed & ~self._of_state()),
            bus.w_ack.eq(bus.w_stb & (~waits | self.grant & ~inner)),
        ]
        # A restart, or a change of program by the port, goes before a write.
        m.d.sync += [
            self.request.eq(bus.w_stb & waits & ~self.grant | other | soon),
            inner.eq(other | soon),
            self.switch.eq(other | soon),
        ]
        if self.selector:
            m.d.sync += self.chosen.eq(~other)
            with m.If(self.grant & self.switch):
                m.d.sync += self.program.eq(self.choice)
        elif self.programs > 1:
            # Bit 8 of the address must be 0, or another lane's bank would be written.
            with m.If(fixed & ~bus.addr[8] & (offset == registers.PROGRAM - registers.FIRST)):
                m.d.comb += waits.eq(bus.w_data < self.programs)
            m.d.sync += self.switch.eq(fixed | soon)
            with m.If(self.grant & self.switch & ~inner):
                m.d.sync += self.program.eq(bus.w_data)

        flags, updates = self._flags(m, bus.w_stb & fixed & ~offset.any())
        flags |= {"idle": self.idle, "parity": self.parity}
        # A shift by 0 would be a separate cell.
        bits = (flags[f.name] << f.bit if f.bit else flags[f.name] for f in registers.STATUS.fields)
        with m.Switch(offset):
            for register, value in (
                (registers.STATUS, reduce(or_, bits)),
                (registers.UPDATES, updates),
                (registers.BUILD_LOW, self.digest),
                (registers.BUILD_HIGH, self.digest >> word),
            ):
                with m.Case(register.address - registers.FIRST):
                    m.d.sync += bus.r_data.eq(value)
            with m.Default():
                m.d.sync += bus.r_data.eq(self.program)
        return m

    def _restarts(self, m: Module, asked: Value) -> Value:
        """Whether the selected program has to restart; ``asked``: from this cycle on."""
        due = Signal(self.programs, init=(1 << self.programs) - 1)
        m.d.comb += self.anew.eq(due.bit_select(self.program, 1))
        for number in range(self.programs):
            selected = self.program == number
            m.d.sync += due[number].eq(selected & asked | due[number] & ~(selected & self.start))
        return self.anew | asked

    def _of_state(self) -> Value:
        """Whether the address is below the fixed ones, but outside the banks' lower halves."""
        lower = self.machine.bank_depth // 2
        if lower >= self.machine.bus_bank_words:
            return Const(0)
        return self.bus.addr[lower.bit_length() - 1]

    def _flags(self, m: Module, cleared: Value) -> tuple[dict[str, Value], Signal]:
        """Sticky flags, which a write clears, and the number of updates."""
        flags: dict[str, Value] = {}
        updates = Signal(self.machine.arithmetic.word)
        w_data = self.bus.w_data
        written: Any = data.View(layout_of(registers.STATUS.fields, width=len(w_data)), w_data)
        for name, event in (
            ("saturated", self.saturated & self.en),
            ("beyond", self.beyond & self.en),
            ("framing", self.framing),
        ):
            flags[name] = flag = Signal(name=name)
            m.d.sync += flag.eq(event | flag & ~(cleared & written[name]))
        for event, last in (
            (self.saturated, self.saturated_update),
            (self.beyond, self.beyond_update),
        ):
            pending = Signal(name=f"{last.name}_pending")
            with m.If(self.en):
                m.d.sync += pending.eq((pending | event) & ~(self.framing | self.commit))
            with m.If(self.commit):
                m.d.sync += last.eq(pending | event)
        with m.If(self.commit):
            m.d.sync += updates.eq(updates + 1)
        return flags, updates
