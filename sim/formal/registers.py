"""Proofs of the core's register bus: `gateware.bus.core_registers`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Cat, Const, Module, Mux, Signal

from boresight.gateware.bus.core_registers import Registers
from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.registers import PROGRAM, RESTART
from boresight.sim.formal.harness import Harness, before, drive, reached
from boresight.sim.formal.prove import Proof

_EVENTS = ("en", "saturated", "beyond", "framing", "commit", "idle", "parity")


class RegistersHarness(Harness[Registers]):
    """Registers: a write is requested until it is granted, granted once, and acknowledged.

    Nothing is granted or acknowledged without a write; a word read is that of the address of the
    cycle before. The initiator holds its word until the reply, and the machine grants requests.
    Each program has to restart after a reset, and the selected one when it is asked to, until it
    does so.
    """

    def surround(self, m: Module, dut: Registers) -> None:
        """Initiator and machine, with their assumptions."""
        bus = dut.bus
        addr, w_data, w_stb = drive(m, bus, "addr", "w_data", "w_stb")
        grant, *_ = drive(m, dut, "grant", *_EVENTS)
        # A write is held until it is acknowledged; the machine grants only what is requested.
        waited = before(m, w_stb & ~bus.w_ack, "waited")
        same = (addr == before(m, addr, "addr_before")) & (
            w_data == before(m, w_data, "w_data_before")
        )
        m.d.comb += [Assume(~waited | (w_stb & same)), Assume(~grant | dut.request)]
        # 512 addresses for all banks: of each those of its lower half are parameters.
        offset, half = addr[:9] % (512 // dut.machine.lanes), dut.machine.bank_depth // 2
        parameter = ~addr[9] & (offset < half)
        chosen = addr[9] & ~addr[8] & (addr[:3] == PROGRAM % 8) & (w_data < dut.programs)
        change = chosen if dut.programs > 1 and not dut.selector else Const(0)
        first = self._restarts(m, w_stb & addr[9] & (addr[:3] == RESTART.address % 8))
        self._writes(m, parameter | change, change, first, waited)
        self._reads(m)

    def _restarts(self, m: Module, written: Any) -> Any:
        """Programs that have to restart; whether a grant is for that or a change by the port."""
        dut = self.dut
        due = Signal(dut.programs, init=(1 << dut.programs) - 1, name="must_restart")
        restart, start = drive(m, dut, "restart", "start")
        selected = (Const(1) << dut.program)[: dut.programs]
        asked = Mux(restart | written, selected, 0)
        m.d.sync += due.eq(due & ~Mux(start, selected, 0) | asked)
        m.d.comb += [
            Assert(dut.anew == (due & selected).any()),
            Assert(due == self.inside["due"]),  # for induction
            reached(m, dut.grant & dut.anew, "restarted"),
        ]
        soon = dut.anew | restart | written
        if dut.selector:
            (choice,) = drive(m, dut, "choice")
            m.d.comb += Assume(choice < dut.programs)
            soon = soon | (choice != dut.program)
        first = before(m, soon, "first")
        m.d.comb += Assert(first == self.inside["inner"])
        return first

    def _writes(self, m: Module, needs_grant: Any, change: Any, first: Any, waited: Any) -> None:
        """Writes, restarts and changes of the program; ``change`` is one by the bus."""
        dut, bus, grant, w_stb = self.dut, self.dut.bus, self.dut.grant, self.dut.bus.w_stb
        program = Signal(range(dut.programs), name="program_now")
        turn, granted = grant & ~first, before(m, grant, "granted")
        if dut.selector:
            with m.If(grant & first):
                m.d.sync += program.eq(dut.choice)
            m.d.comb += Assert(dut.chosen == before(m, dut.program == dut.choice, "was_chosen"))
        else:
            with m.If(turn & change):
                m.d.sync += program.eq(bus.w_data)
        m.d.comb += [
            # A restart or a change by the port goes first, and acknowledges no write.
            Assert(~first | dut.switch),
            # Only the present write is granted: no phantom.
            Assert(~turn | (w_stb & needs_grant & bus.w_ack & (dut.switch == change))),
            # An acknowledged write is granted in the same cycle, or need not be granted.
            Assert(~bus.w_ack | (w_stb & (turn | ~needs_grant))),
            Assert(~w_stb | needs_grant | bus.w_ack),
            # It is requested from its second cycle on, until the grant: none is lost.
            Assert(dut.request == ((first | (waited & needs_grant)) & ~granted)),
            Assert((dut.program == program) & (dut.program < dut.programs)),
            reached(m, turn & ~dut.switch, "parameter_written"),
            reached(m, waited & bus.w_ack & w_stb, "waited_long"),
        ]
        if dut.programs > 1:
            m.d.comb += reached(m, dut.program == dut.programs - 1, "last_program")

    def _reads(self, m: Module) -> None:
        """A second model of the registers 512 to 516."""
        inside = self.inside
        dut, bus, word = self.dut, self.dut.bus, self.dut.machine.arithmetic.word
        addr, mask = bus.addr, (1 << word) - 1
        flags, updates = Signal(5, name="flags"), Signal(word, name="updates")
        pending, last = Signal(2, name="pending"), Signal(2, name="last_update")
        cleared = Mux(bus.w_stb & addr[9] & (addr[:3] == 0), bus.w_data[:5], 0)
        found = Mux(dut.en, Cat(dut.saturated, dut.beyond), 0)
        m.d.comb += Assume(dut.en | ~(dut.commit | dut.framing))
        m.d.sync += flags.eq(flags & ~cleared | found[0] | dut.framing << 1 | found[1] << 4)
        with m.If(dut.commit):
            m.d.sync += [updates.eq(updates + 1), last.eq(pending | found)]
        m.d.sync += pending.eq(Mux(dut.commit | dut.framing, 0, pending | found))
        status = flags | dut.idle << 2 | dut.parity << 3
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
            Assert(Cat(dut.saturated_update, dut.beyond_update) == last),
            # For induction.
            Assert(flags == Cat(inside["saturated"], inside["framing"], 0, 0, inside["beyond"])),
            Assert(updates == inside["updates"]),
            Assert(
                pending == Cat(inside["saturated_update_pending"], inside["beyond_update_pending"])
            ),
            reached(m, documented & (dut.bus.r_data == 2), "counted"),
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
