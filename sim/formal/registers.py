"""Proofs of the core's register bus: `gateware.bus.core_registers`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Const, Module, Mux, Signal

from boresight.gateware.bus.core_registers import Registers
from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.registers.core import PROGRAM
from boresight.sim.formal.harness import after_start, before, reached, unknown
from boresight.sim.formal.inside import InductiveHarness, Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "RegistersHarness"]

_EVENTS = ("saturated", "framing", "commit", "idle", "parity")


class RegistersHarness(InductiveHarness[Registers]):
    """Registers: a write is requested until it is granted, granted once, and acknowledged.

    Nothing is granted or acknowledged without a write; a word read is that of the address of the
    cycle before. The initiator holds its word until the reply, and the machine grants requests.
    """

    def surround(self, m: Module, dut: Registers) -> None:
        """Initiator and machine, with their assumptions."""
        inside = self.inside
        bus, word = dut.bus, dut.machine.arithmetic.word
        addr, w_data = unknown(m, 10, "addr"), unknown(m, word, "w_data")
        w_stb, grant = unknown(m, 1, "w_stb"), unknown(m, 1, "grant")
        events = {name: unknown(m, 1, name) for name in _EVENTS}
        m.d.comb += [
            bus.addr.eq(addr),
            bus.w_data.eq(w_data),
            bus.w_stb.eq(w_stb),
            dut.grant.eq(grant),
            *(getattr(dut, name).eq(signal) for name, signal in events.items()),
        ]
        # A write is held until it is acknowledged; the machine grants only what is requested.
        waited = before(m, w_stb & ~bus.w_ack, "waited")
        same = (addr == before(m, addr, "addr_before")) & (
            w_data == before(m, w_data, "w_data_before")
        )
        m.d.comb += [Assume(~waited | (w_stb & same)), Assume(~grant | dut.request)]
        # 512 addresses for all banks: of each those of its lower half are parameters.
        offset, half = addr[:9] % (512 // dut.machine.lanes), dut.machine.bank_depth // 2
        parameter = ~addr[9] & (offset < half)
        if dut.selector:
            self._by_port(m, w_stb=w_stb, parameter=parameter, grant=grant, waited=waited)
        else:
            self._by_bus(
                m,
                addr=addr,
                w_data=w_data,
                w_stb=w_stb,
                parameter=parameter,
                grant=grant,
                waited=waited,
            )
        self._reads(m, inside, addr=addr, w_data=w_data, w_stb=w_stb, **events)

    def _by_bus(
        self,
        m: Module,
        *,
        addr: Any,
        w_data: Any,
        w_stb: Any,
        parameter: Any,
        grant: Any,
        waited: Any,
    ) -> None:
        """Writes, if the bus also chooses the program."""
        dut, bus = self.dut, self.dut.bus
        change = (
            addr[9] & ~addr[8] & (addr[:3] == PROGRAM % 8) & (w_data < dut.programs)
            if dut.programs > 1
            else Const(0)
        )
        needs_grant = parameter | change
        program = Signal(range(dut.programs), name="program_now")
        with m.If(grant & dut.switch):
            m.d.sync += program.eq(w_data)
        m.d.comb += [
            # Only the present write is granted: no phantom.
            Assert(~grant | (w_stb & needs_grant & bus.w_ack & (dut.switch == change))),
            # An acknowledged write is granted in the same cycle, or need not be granted.
            Assert(~bus.w_ack | (w_stb & (grant | ~needs_grant))),
            Assert(~w_stb | needs_grant | bus.w_ack),
            # It is requested from its second cycle on, until the grant: none is lost.
            Assert(dut.request == (waited & needs_grant)),
            Assert((dut.program == program) & (dut.program < dut.programs)),
            reached(m, grant & ~dut.switch, "parameter_written"),
            reached(m, waited & bus.w_ack & w_stb, "waited_long"),
        ]
        if dut.programs > 1:
            m.d.comb += reached(m, dut.program == dut.programs - 1, "last_program")

    def _by_port(self, m: Module, *, w_stb: Any, parameter: Any, grant: Any, waited: Any) -> None:
        """Writes, if a port chooses the program."""
        dut, bus = self.dut, self.dut.bus
        choice = unknown(m, dut.choice.shape(), "choice")
        m.d.comb += [dut.choice.eq(choice), Assume(choice < dut.programs)]
        program = Signal(range(dut.programs), name="program_now")
        turn = grant & ~dut.switch
        with m.If(grant & dut.switch):
            m.d.sync += program.eq(choice)
        differs = before(m, choice != dut.program, "differed")
        granted = before(m, grant, "granted")
        m.d.comb += [
            Assert(~turn | (w_stb & parameter & bus.w_ack)),
            Assert(~bus.w_ack | (w_stb & (turn | ~parameter))),
            Assert(~w_stb | parameter | bus.w_ack),
            # Pending writes are requested; a change of the program as well, and it goes first.
            Assert(~(waited & parameter) | granted | dut.request),
            Assert(~differs | granted | (dut.request & dut.switch)),
            Assert(~dut.request | differs | (waited & parameter)),
            Assert((dut.program == program) & (dut.program < dut.programs)),
            Assert(dut.chosen == before(m, dut.program == choice, "was_chosen")),
            reached(m, turn, "parameter_written"),
            reached(m, dut.program == dut.programs - 1, "last_program"),
            reached(m, waited & bus.w_ack & w_stb, "waited_long"),
        ]

    def _reads(
        self,
        m: Module,
        inside: Inside,
        *,
        addr: Any,
        w_data: Any,
        w_stb: Any,
        saturated: Any,
        framing: Any,
        commit: Any,
        idle: Any,
        parity: Any,
    ) -> None:
        """A second model of the registers 512 to 516."""
        dut, word = self.dut, self.dut.machine.arithmetic.word
        mask = (1 << word) - 1
        flags, updates = Signal(2, name="flags"), Signal(word, name="updates")
        pending, last = Signal(name="pending"), Signal(name="last_update")
        cleared = Mux(w_stb & addr[9] & (addr[:3] == 0), w_data[:2], 0)
        m.d.sync += flags.eq(flags & ~cleared | saturated | framing << 1)
        with m.If(commit):
            m.d.sync += [updates.eq(updates + 1), last.eq(pending | saturated)]
        m.d.sync += pending.eq(Mux(commit | framing, 0, pending | saturated))
        status = flags | idle << 2 | parity << 3
        values = Array(
            [
                status,
                updates,
                Const(dut.digest & mask, word),
                Const(dut.digest >> word & mask, word),
                dut.program,
            ]
        )
        value = Signal(word, name="expected")
        m.d.comb += value.eq(values[addr[:3]])
        documented = before(m, (addr >= 512) & (addr <= PROGRAM), "documented")
        m.d.comb += [
            Assert(~documented | (dut.bus.r_data == before(m, value, "read_before"))),
            Assert(dut.saturated_update == last),
            # For induction.
            Assert(flags == inside["saturated"] + 2 * inside["framing"]),
            Assert((updates == inside["updates"]) & (pending == inside["pending"])),
            reached(m, after_start(m) & documented & (dut.bus.r_data == 2), "counted"),
        ]


def _proof(config: str, programs: int, *, selector: bool = False, short: bool = False) -> Proof:
    machine = ALL_CONFIGS[config]
    digest = (1 << 2 * machine.arithmetic.word) // 7
    return Proof(
        name=f"registers.{config}_{programs}" + ("_selector" if selector else ""),
        harness=RegistersHarness,
        dut=lambda: Registers(machine=machine, digest=digest, programs=programs, selector=selector),
        depth=4,
        induction=True,
        cover=12,
        short=short,
    )


PROOFS = (
    _proof("small", 1, short=True),
    _proof("fast", 3),
    _proof("small-1024", 4),
    _proof("small", 4, selector=True),
)
