"""Proofs of the compass's commands: `gateware.attitude.sensors.hmr3300_command`."""

from __future__ import annotations

from amaranth.hdl import Array, Assert, Assume, Const, Module, Mux, Signal, Value

from boresight.gateware.attitude.sensors.hmr3300_command import TRIES, Commander, Stage
from boresight.sim.formal.harness import before, reached, unknown
from boresight.sim.formal.inside import InductiveHarness, Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "CommanderHarness"]


class CommanderHarness(InductiveHarness[Commander]):
    """Commander: each command is sent whole and in order, for its reason and in its time.

    An attempt begins for its reasons; each stage ends with its effect, a refusal or the time-out,
    whichever comes first; a pause follows four failures. An attempt ends within three time-outs, a
    pause within four. Bytes, sentences and refusals of the compass, the mode, letters of the user,
    ticks and the pace of the line are any.
    """

    def surround(self, m: Module, dut: Commander) -> None:
        """The bytes; then the stages, by counters of ticks."""
        inside = self.inside
        for name in ("mode", "tick", "heard", "line", "is_counts", "invalid"):
            port = getattr(dut, name)
            m.d.comb += port.eq(unknown(m, port.shape(), f"{name}_in"))
        user, letter = unknown(m, 1, "user"), unknown(m, 8, "letter")
        ready = unknown(m, 1, "ready")
        m.d.comb += [dut.command.valid.eq(user), dut.command.payload.eq(letter)]
        m.d.comb += dut.o.ready.eq(ready)
        waits = before(m, user & ~dut.command.ready, "user_waits")
        m.d.comb += Assume(~waits | (user & (letter == before(m, letter, "letter_before"))))
        stage = self._stages(m, inside, user)

        number = Signal(2, name="number")  # of the byte
        taken = dut.o.valid & ready
        with m.If(taken):
            m.d.sync += number.eq(number + 1)
        kind = Mux(dut.mode[1], ord("M"), ord("H"))
        code = Mux(stage == Stage.SELECT.value, kind, ord("S"))
        command = Array([Const(ord("*"), 8), Mux(dut.busy, code, letter), *map(ord, "\r\n")])
        stood = before(m, dut.o.valid & ~ready, "stood")
        m.d.comb += [
            Assert(~dut.o.valid | (dut.o.payload == command[number])),
            Assert(dut.o.valid | (number == 0)),
            Assert(~stood | dut.o.valid),
            Assert(dut.command.ready == (taken & ~dut.busy & (number == 1))),
            Assert(dut.sent == (taken & (number == 3))),
            reached(m, dut.sent & ~dut.busy, "users"),
            reached(m, taken & dut.busy, "ours"),
            # For induction.
            Assert(inside["left"] == Mux(dut.o.valid, 4 - number, 0)),
            Assert(~dut.o.valid | (inside["manual"] == ~dut.busy)),
            Assert(~dut.o.valid | dut.busy | (number > 1) | user),
        ]

    def _stages(self, m: Module, inside: Inside, user: Value) -> Signal:
        """Why and when each stage begins and ends, by counters of ticks."""
        dut = self.dut
        end, quiet_ticks = dut.timeout_ticks, dut.quiet_ticks
        timeout = end + 1
        stage = Signal(range(len(Stage)), name="stage_wanted")
        since = Signal(range(timeout), name="since")  # ticks of this stage, after its command
        # Ticks until the line is quiet; attempts that failed, or in the pause its time-outs.
        noise = Signal(range(2 * quiet_ticks), init=(1 << quiet_ticks.bit_length()) - 1)
        failures = Signal(range(TRIES), name="failures")
        idle, tick, any_kind = ~dut.o.valid, dut.tick, ~dut.mode.any()
        overdue, quiet = tick & (since == end), noise == 0
        other_line = dut.line & ~any_kind & (dut.is_counts != (dut.mode >= 2))
        wanted_line = dut.line & ~other_line
        watches, pauses = stage == Stage.WATCH.value, stage == Stage.PAUSE.value
        starting, attempt = stage == Stage.START.value, ~watches & ~pauses
        effect = Mux(starting, wanted_line, quiet)
        succeeds = idle & attempt & effect
        fails = idle & attempt & ~effect & (overdue | dut.invalid)
        begins = idle & watches & ~user & ~any_kind & (overdue | other_line)
        rests = idle & pauses & overdue
        sends = begins | (succeeds & ~starting) | (idle & ~attempt & user)
        m.d.sync += since.eq(Mux(overdue, 0, since + tick))
        with m.If(dut.o.valid | begins | succeeds | fails | (watches & (wanted_line | any_kind))):
            m.d.sync += since.eq(0)
        with m.If(dut.heard | dut.o.valid):
            m.d.sync += noise.eq(quiet_ticks)
        with m.Elif(tick & ~quiet):
            m.d.sync += noise.eq(noise - 1)
        with m.If(begins):
            m.d.sync += stage.eq(Mux(quiet, Stage.SELECT.value, Stage.STOP.value))
        with m.If(succeeds):
            m.d.sync += stage.eq(Mux(starting, Stage.WATCH.value, stage + 1))
        with m.If(succeeds & starting):
            m.d.sync += failures.eq(0)
        with m.If(fails | rests):
            m.d.sync += failures.eq(failures + 1)
        with m.If(fails):
            m.d.sync += stage.eq(Stage.WATCH.value)
        with m.If((fails | rests) & (failures == TRIES - 1)):
            m.d.sync += stage.eq(Mux(fails, Stage.PAUSE.value, Stage.WATCH.value))
        m.d.comb += [
            Assert(dut.busy == attempt),
            Assert(dut.paused == pauses),
            Assert(dut.o.valid == before(m, sends | (dut.o.valid & ~dut.sent), "is_sent")),
            Assert(dut.acknowledged == (succeeds & (stage != Stage.SELECT.value))),
            Assert(dut.timed_out == fails),
            reached(m, dut.acknowledged & starting, "answered"),
            # For induction.
            Assert(stage <= Stage.PAUSE.value),
            Assert(inside["stage"] == stage),
            Assert(inside["timer"] == since),
            Assert(inside["tries"] == failures),
            Assert(inside["silence"] == (1 << len(inside["silence"])) - 1 - noise),
            Assert(~attempt | idle | (since == 0)),
        ]
        self._bounds(
            m,
            timeout,
            (attempt, idle, 3, (stage - 1) * timeout + since),
            (watches, idle & ~user & ~wanted_line & ~any_kind, 1, since),
            (pauses, idle & ~user, TRIES, failures * timeout + since),
        )
        return stage

    def _bounds(self, m: Module, timeout: int, *waits: tuple[Value, Value, int, Value]) -> None:
        """Ticks of an attempt, until one begins, of a pause: at most so many time-outs."""
        for k, (active, counts, limit, bound) in enumerate(waits):
            ticks = Signal(range(limit * timeout + 2), name=f"ticks{k}")
            m.d.sync += ticks.eq(ticks + (counts & self.dut.tick))
            with m.If(~active | (~counts if k else 0)):
                m.d.sync += ticks.eq(0)
            m.d.comb += [Assert(ticks <= limit * timeout), Assert(~active | (ticks <= bound))]


PROOFS = (
    Proof(
        name="commander.sequences",
        harness=CommanderHarness,
        dut=lambda: Commander(timeout_ticks=3, quiet_ticks=2),
        depth=3,
        induction=True,
        cover=31,
    ),
)
