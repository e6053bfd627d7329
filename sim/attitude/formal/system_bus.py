"""Proof of the register bus of a complete system: `gateware.attitude.system.system_bus`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from amaranth.hdl import Array, Assert, Assume, Const, Module, Mux, Signal, Value

from boresight.gateware.attitude.system.interface import system_registers
from boresight.gateware.attitude.system.system_bus import ADDRESS_BITS, COUNTERS, RESULTS, SystemBus
from boresight.gateware.registers.core import PROGRAM
from boresight.gateware.registers.model import Access, Register
from boresight.sim.formal.harness import after_start, before, fixed, reached, unknown
from boresight.sim.formal.inside import InductiveHarness, Inside
from boresight.sim.formal.prove import Proof

#: Kinds of events from outside.
EVENTS = 5
#: A word of the results that is never written and reads 0.
NO_RESULT = 63


def registers() -> tuple[Register, ...]:
    """The block of a system with three filters, which needs a check of numbers."""
    return system_registers(filters=("one", "two", "three"), clock_hz=100e6, build=0x1234_5678_9ABC)


def _to_core(addr: Value) -> Value:
    return addr <= PROGRAM


def _to_results(addr: Value) -> Value:
    return (addr >= RESULTS) & (addr < RESULTS + 64)


class SystemBusHarness(InductiveHarness[SystemBus]):
    """SystemBus: a write changes its own register and no other, a read returns its own word.

    A register changes only to a number that it may hold. Writes to the core reach it unchanged and
    are acknowledged by it alone. A second model of every register follows its declaration.

    Parameters
    ----------
    dut : SystemBus
        Component, made of `registers` and `EVENTS`.
    """

    def surround(self, m: Module, dut: SystemBus) -> None:
        """Any initiator, core and results."""
        inside = self.inside
        bus, core = dut.bus, dut.core
        addr, w_data = unknown(m, ADDRESS_BITS, "addr"), unknown(m, 32, "w_data")
        w_stb, read = unknown(m, 1, "w_stb"), unknown(m, 1, "read")
        core_word, results_word = unknown(m, 32, "core_word"), unknown(m, 32, "results_word")
        core_ack = unknown(m, 1, "core_ack")
        m.d.comb += [
            bus.addr.eq(addr),
            bus.w_data.eq(w_data),
            bus.w_stb.eq(w_stb),
            dut.read.eq(read),
            core.w_ack.eq(core_ack),
            core.r_data.eq(core_word),
            dut.results.value.eq(results_word),
            dut.events.eq(unknown(m, EVENTS, "events")),
            dut.clear.eq(unknown(m, 1, "clear")),
            Assume(~core_ack | core.w_stb),
            Assume(before(m, dut.results.index != NO_RESULT, "of_result") | (results_word == 0)),
        ]
        waited = before(m, w_stb & ~bus.w_ack, "waited")
        m.d.comb += Assume(
            ~waited
            | (
                w_stb
                & (addr == before(m, addr, "addr_before"))
                & (w_data == before(m, w_data, "w_data_before"))
            )
        )

        words, stored = self._words(m, addr=addr, w_data=w_data, w_done=bus.w_ack)
        expected, defined = self._expected(m, words, addr)
        bad_access = before(m, (read | (w_stb & ~waited)) & ~defined, "bad_before")
        to_core, to_results = _to_core(addr), _to_results(addr)
        # One arbitrary word of each memory is followed.
        offset = fixed(m, len(dut.csr.offset), "offset")
        number = fixed(m, dut.counters.index_bits, "number")
        followed = before(
            m, (dut.csr.offset == offset) & (dut.counters.index == number), "followed"
        ) & after_start(m)
        m.d.comb += [
            Assert(~followed | (bus.r_data == expected)),
            Assert(core.w_stb == (w_stb & to_core)),
            Assert(~core.w_stb | ((core.addr == addr) & (core.w_data == w_data))),
            Assert(bus.w_ack == (w_stb & Mux(to_core, core_ack, waited))),
            Assert(dut.results.index == Mux(to_results, addr[:6], NO_RESULT)),
            Assert(~followed | (inside["bad"] == bad_access)),
            reached(m, dut.filter == 2, "third_filter"),
            reached(m, followed & (bus.r_data == 0x424F5245), "identified"),
            reached(m, core.w_stb & core_ack & waited, "core_waited"),
        ]
        self._memories(m, inside, stored, offset=offset, number=number)

    def _expected(self, m: Module, words: Mapping[int, Any], addr: Signal) -> tuple[Value, Value]:
        """The word at the address of the cycle before; whether that of this cycle is mapped."""
        dut = self.dut
        to_core, to_results = _to_core(addr), _to_results(addr)
        to_counters = (addr >= COUNTERS) & (addr <= COUNTERS + EVENTS)
        register_word, defined = Signal(32, name="own_word"), Signal(name="known")
        with m.Switch(addr):
            for address, word in words.items():
                with m.Case(address):
                    m.d.comb += [register_word.eq(word), defined.eq(1)]
        word = before(m, register_word, "own_before")
        word = Mux(before(m, to_counters, "of_counters"), dut.counters.value, word)
        word = Mux(before(m, to_results, "of_results"), dut.results.value, word)
        word = Mux(before(m, to_core & (addr >= 512), "of_core"), dut.core.r_data, word)
        return word, to_core | defined | to_results | to_counters

    def _words(
        self, m: Module, *, addr: Any, w_data: Any, w_done: Any
    ) -> tuple[dict[int, Any], dict[int, Any]]:
        """Word read at each address, and its word in the memory."""
        words: dict[int, Any] = {}
        stored: dict[int, Any] = {
            r.address: Const(1 << 32 | (r.reset or 0), 33) for r in self.dut.csr.registers
        }
        for register in self.dut.csr.registers:
            hit, name = w_done & (addr == register.address), register.name
            width = register.width or 32
            if register.access is Access.READ_ONLY:
                if register.reset is None:
                    words[register.address] = unknown(m, width, name)
                    m.d.comb += getattr(self.dut, name).eq(words[register.address])
                else:
                    words[register.address] = register.reset
            elif register.access is Access.WRITE_ONLY:
                words[register.address] = 0
                strobe, command = getattr(self.dut, f"{name}_stb"), getattr(self.dut, name)
                m.d.comb += [Assert(strobe == hit), Assert(command == Mux(hit, w_data[:width], 0))]
            else:
                value = Signal(
                    width, name=f"kept_{name}", init=register.reset or 0, reset_less=True
                )
                words[register.address], stored[register.address] = value, value | 1 << 32
                legal = w_data[:width] < (len(register.names) or 1 << width)
                with m.If(hit & legal):
                    m.d.sync += value.eq(w_data)
                m.d.comb += Assert(getattr(self.dut, name) == value)
        return words, stored

    def _memories(
        self, m: Module, inside: Inside, stored: dict[int, Any], *, offset: Any, number: Any
    ) -> None:
        """The block's memory and the counters': for induction."""
        dut, csr, counters = self.dut, inside.parts["csr"], inside.parts["counters"]
        words = Array(stored.get(dut.csr.first + k, Const(0, 33)) for k in range(1 << len(offset)))
        m.d.comb += Assert(csr.word("memory", offset) == words[offset])
        # Counters without an event are 0.
        counter, step, count = counters["turn"][2:], counters["turn"][:2], dut.counters.count
        scanned = counters.parts["memory"].component.read_ports[0].data
        m.d.comb += [
            Assert((number < count) | (counters.word("memory", number) == 0)),
            Assert(
                (counter < count) | (counter != number) | (step < 2) | (scanned.as_value() == 0)
            ),
            Assert(counters["turned"][count:] == 0),
        ]


PROOFS = (
    Proof(
        name="bus.system",
        short=False,
        harness=SystemBusHarness,
        dut=lambda: SystemBus(registers=registers(), events=EVENTS),
        depth=3,
        induction=True,
        cover=8,
    ),
)
