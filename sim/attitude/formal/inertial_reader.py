"""Proofs of the reader of the inertial sensor: `gateware.attitude.sensors.adis16385`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Assert, Assume, Cat, Const, Fragment, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.adis16385_flags import EVENTS, FLAGS
from boresight.gateware.attitude.sensors.adis16385_frames import CHECKED, REGISTERS, WORDS
from boresight.gateware.attitude.sensors.adis16385_setup import Settings, Timing
from boresight.gateware.attitude.sensors.spi import BITS
from boresight.sim.formal.harness import Harness, after_start, before, fixed, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "Frames", "Sampled", "scaled"]

#: States of the reader.
_RESET, _STARTUP, _START, _EDGE, _BURST = range(5)
_NAMES = ("RESET", "STARTUP", "FRAMES", "EDGE", "FRAMES")
#: Number of the last frame of a start, of a sample.
_LAST_START, _LAST = 12, 8
#: Registers that the frames of a start and of a sample read or write, in order; None: the one that
#: is checked with this sample.
_STARTS = ("PROD_ID", "PROD_ID", *(n for n in CHECKED[1:] for _ in range(2)), *CHECKED, "TEMP_OUT")
_SAMPLES = (*WORDS[:6], "DIAG_STAT", None, "TEMP_OUT")
#: Frames of a start that write, and those whose answers are checked.
_WRITES, _CHECKS = range(2, 8), (1, 9, 10, 11, 12)


class Frames(wiring.Component):
    """An SPI controller by what its proof says of it, with frames and stalls of any length.

    A command is taken while no frame and no stall is under way. Each one is answered once, two
    cycles later or more; the answer stays until the next command is taken, and the stall after it
    lasts three cycles or more, as does that after a reset. What is answered is any.

    Parameters
    ----------
    quick : bool
        Every frame and stall is as short as it can be (to reach more in the same cycles).

    Members
    -------
    answer : In(16)
        The answer to a frame, if it ends in this cycle.
    Others as of `SpiController`.
    """

    def __init__(self, *, quick: bool = False) -> None:
        self.quick = quick
        pins = {"cs_n": Out(1), "sclk": Out(1), "mosi": Out(1), "miso": In(1)}
        super().__init__(
            {
                **pins,
                "i": In(stream.Signature(BITS)),
                "answer": In(BITS),
                "o_data": Out(BITS),
                "o_valid": Out(1),
                "busy": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Frame, stall, rest; each ends when it will."""
        m = Module()
        go = Const(1) if self.quick else unknown(m, 1, "goes")
        framed, stalled = Signal(name="framed"), Signal(init=1, name="stalled")
        cycles, word = Signal(2, name="cycles"), Signal(BITS, name="answered_word")
        m.d.comb += [
            self.i.ready.eq(~framed & ~stalled),
            self.busy.eq(framed | stalled),
            self.o_data.eq(word),
        ]
        m.d.sync += [self.o_valid.eq(0), cycles.eq(cycles + ~cycles[1])]
        with m.If(self.i.ready & self.i.valid):
            m.d.sync += [framed.eq(1), cycles.eq(1)]
        with m.If(framed & go):
            m.d.sync += [framed.eq(0), stalled.eq(1), self.o_valid.eq(1), word.eq(self.answer)]
            m.d.sync += cycles.eq(0)
        with m.If(stalled & cycles[1] & go):
            m.d.sync += stalled.eq(0)
        return m


def scaled(component: type[Adis16385] = Adis16385, *, quick: bool = False) -> Adis16385:
    """A reader with short waits, whose frames are `Frames`.

    Ticks of 2 cycles, 2 for the reset pulse, 1 for the wait after it, 4 for the time-out.
    """
    # The component takes times; its counts of ticks are replaced by smaller ones.
    reader = component(
        clock_hz=1e6, timing=Timing(period_s=0.05, startup_s=1e-3), settings=Settings(bad_limit=2)
    )
    Fragment.get(reader.spi, None)  # it is not used
    reader.spi = Frames(quick=quick)
    reader.tick_bit = 0 if quick else 1
    reader.reset_ticks, reader.startup_ticks = 1, 1
    reader.timeout_ticks = 40 if quick else 4
    return reader


class Sampled(Harness[Adis16385]):
    """Commands, the use of the answers, and restarts of the reader.

    Answers, data-ready, settings and orders are any. One word of the sample is followed, any, but
    the same always.

    Parameters
    ----------
    dut : Adis16385
        Component, as of `scaled`.
    """

    def surround(self, m: Module, dut: Adis16385, inside: Inside) -> None:
        """Inputs; waits; the states and frames; the sample and its judgement."""
        spi = dut.spi
        self.inside = inside
        self.time = time = Signal(32, name="clock")
        for name in ("data_ready", "miso", "msc_ctrl", "smpl_prd", "sens_avg"):
            port = getattr(dut, name)
            value = time[4] if name == "data_ready" else port.init
            value = value if spi.quick else unknown(m, port.shape(), f"{name}_in")
            m.d.comb += port.eq(value)
        m.d.sync += time.eq(time + 1)
        m.d.comb += dut.time.eq(time)

        self.state = state = Signal(3, init=_RESET, name="state")
        self.frame, self.turn = Signal(4, name="frame"), Signal(2, name="turn")
        # The command of the last frame, and the register that the one before it asked for.
        self.sent, self.asked = Signal(16, name="sent"), Signal(7, name="asked")
        self.used = [Signal(16, name=f"used{k}") for k in range(3)]
        self.start_over = Signal(name="starts_over")
        self.running = (state == _EDGE) | (state == _BURST)
        self.framing = (state == _START) | (state == _BURST)
        ready = inside.parts["synchroniser"].component.o
        self.edge = ready & ~before(m, ready, "ready_before_")
        self.takes = spi.i.valid & spi.i.ready
        self._surroundings(m)
        self.expired = self._waits(m)
        # The cycle after an answer.
        self.reply = before(m, spi.o_valid & self.framing & ~self.start_over, "reply")
        self.heard = before(m, spi.o_data, "heard")
        self._commands(m)
        expected_values = Array([Const(dut.settings.identity, 16), *self.used])
        self.which = Mux(state == _START, Mux(self.frame == 1, 0, self.frame - 9), self.turn)[:2]
        self.right = self.heard == expected_values[self.which]
        checks = [self.frame == k for k in _CHECKS]
        self.start_check = self.reply & (state == _START) & Cat(checks).any()
        self.judged = self.reply & (state == _BURST) & (self.frame == _LAST)
        self._sample(m)
        self._judge(m)
        self._states(m)

    def _surroundings(self, m: Module) -> None:
        """Answers and orders: any."""
        m.d.comb += [
            self.dut.spi.answer.eq(unknown(m, BITS, "answer")),
            self.dut.enable.eq(unknown(m, 1, "enable_in")),
            self.dut.restart.eq(unknown(m, 1, "restart_in")),
        ]

    def _waits(self, m: Module) -> Value:
        """Ticks of the clock, and the end of the wait of a state: the tick after so many."""
        dut, time, inside = self.dut, self.time, self.inside
        low = [min(31, dut.tick_bit + min(k, 12)) for k in range(16)]
        decimation = Mux(self.running, self.used[1][8:12], 0)
        falls = (time & Array(Const((1 << bit) - 1, 32) for bit in low)[decimation]) == 0
        tick = before(m, after_start(m) & falls, "is_tick")
        self.begins = begins = Signal(name="begins")
        passed = Signal(range(dut.timeout_ticks + 1), name="passed")
        ticks = Mux(
            self.state == _RESET,
            dut.reset_ticks,
            Mux(self.state == _STARTUP, dut.startup_ticks, dut.timeout_ticks),
        )
        ended = passed == ticks
        with m.If(begins):
            m.d.sync += passed.eq(0)
        with m.Elif(tick & ~ended):
            m.d.sync += passed.eq(passed + 1)
        waits = ~self.framing
        m.d.comb += [
            Assert(inside["tick"] == tick),
            Assert(~waits | (inside["expired"] == (tick & ~begins & ended))),
            # For induction.
            Assert(inside["begin"] == begins),
            Assert(~waits | begins | (passed <= ticks)),
            Assert(~waits | begins | (inside["timer"] == ticks - passed)),
            Assert(~waits | (inside["done"] == (~begins & ended))),
        ]
        return tick & ~begins & ended

    def _commands(self, m: Module) -> None:
        """The frames follow each other without a pause; which register each one asks for."""
        spi, frame, state, inside = self.dut.spi, self.frame, self.state, self.inside

        def addresses(before_: int) -> Value:
            """Of the register that a frame, or the one before, reads or writes."""
            starts = [REGISTERS[name] + (k in _WRITES and k % 2) for k, name in enumerate(_STARTS)]
            checked = Array(Const(REGISTERS[name], 7) for name in CHECKED)[self.turn]
            samples = [checked if n is None else Const(REGISTERS[n], 7) for n in _SAMPLES]
            samples.insert(0, Const(REGISTERS["TEMP_OUT"], 7))
            starts = [Const(0, 7), *(Const(a, 7) for a in starts)]
            at = frame + 1 - before_
            return Mux(state == _START, Array(starts)[at], Array(samples)[at])

        address, earlier = Signal(7, name="address"), Signal(7, name="address_before")
        m.d.comb += [address.eq(addresses(0)), earlier.eq(addresses(1))]
        writes = (state == _START) & Cat(frame == k for k in _WRITES).any()
        data = Array([word[8 * k : 8 * k + 8] for word in self.used for k in range(2)])
        byte = data[(frame - _WRITES.start)[:3]] & writes.replicate(8)
        command = Cat(byte, address, writes)
        # A device answers the request of the frame before.
        with m.If(self.takes):
            m.d.sync += [self.sent.eq(spi.i.payload), self.asked.eq(self.sent[8:15])]
        sent_register = self.sent[8:15]
        port = inside.parts["spi"]
        framed, stalled = port["framed"], port["stalled"]
        out = framed | (stalled & ~port["cycles"][1])
        first = (state == _START) & (frame == 0)
        m.d.comb += [
            Assert(spi.i.valid == self.framing),
            Assert(~self.takes | (spi.i.payload == command)),
            # For induction.
            Assert(~(self.framing & out) | (self.sent == command)),
            Assert(~(self.framing & out) | first | (self.asked == earlier)),
            Assert(~self.framing | out | first | (sent_register == earlier)),
            Assert((state != _EDGE) | ((sent_register == REGISTERS["TEMP_OUT"]) & ~framed)),
        ]
        cycles = port["cycles"]
        m.d.comb += [
            Assert(~(framed & stalled)),
            Assert(~spi.o_valid | (stalled & (cycles == 0))),
            Assert(~self.reply | (stalled & (cycles == 1))),
            Assert(~(self.framing & stalled & ~cycles[1]) | spi.o_valid | self.reply),
        ]
        self.out = out
        self._steps(m, stalled)

    def _steps(self, m: Module, stalled: Value) -> None:
        """The table's row, for induction."""
        inside, frame, turn, state = self.inside, self.frame, self.turn, self.state
        step = inside["step"]
        of_sample = Mux(frame == 7, 24 + turn, Mux(frame == 8, 28 + turn, 16 + frame))
        previous_step = before(m, step, "looked")
        rows: list[dict[str, int]] = [{} for _ in range(32)]
        for k, name in enumerate(_STARTS):
            rows[3 + k] = {
                "command": 0x80 * (k in _WRITES) | REGISTERS[name] + (k in _WRITES and k % 2),
                "writes": k in _WRITES,
                "checks": k in _CHECKS,
                "which": CHECKED.index(name) if k in _WRITES else (3 + k) % 4,
                "ends": k == _LAST_START,
            }
        for k, sampled in enumerate(_SAMPLES):
            for t, checked in enumerate(CHECKED) if k > 6 else ((0, ""),):
                number = 16 + k if k < 7 else 24 + t if k == 7 else 28 + t
                register = _SAMPLES[k - 1] or checked
                rows[number] = {
                    "command": REGISTERS[sampled or checked],
                    "stores": k < _LAST,
                    "place": 0 if k == _LAST else WORDS.index(register) if k else 6,
                    "checks": k == _LAST,
                    "which": number % 4,
                    "whole": k == _LAST,
                    "ends": k == _LAST,
                }
        columns = ("command", "writes", "stores", "place", "checks", "which", "whole", "ends")
        for name in columns:
            column = inside[name]
            table = Array(Const(int(row.get(name, 0)), len(column)) for row in rows)
            m.d.comb += Assert(column == table[previous_step])
        m.d.comb += [
            Assert((state != _START) | (step == 3 + frame)),
            Assert((state != _BURST) | (step == of_sample)),
            Assert((state != _EDGE) | (step == 16) | stalled),
            Assert((state > _STARTUP) | ((state == _RESET) & self.begins) | (step == 3)),
            Assert((state != _STARTUP) | (previous_step == 3)),
            Assert(~self.framing | (previous_step == step) | stalled),
            Assert(~(self.framing & self.out) | (previous_step == step)),
            Assert(~(self.framing & self.out) | (inside["expected"] == inside["known"])),
            Assert((state > _BURST) == 0),
            Assert(frame <= Mux(state == _START, _LAST_START, _LAST)),
            Assert(self.framing | (frame == 0)),
        ]

    def _sample(self, m: Module) -> None:
        """A word is the last answer to a frame that asked for it, and of the sample's burst."""
        dut, spi, state, frame = self.dut, self.dut.spi, self.state, self.frame
        index = Const(6) if spi.quick else fixed(m, 3, "which_word")
        m.d.comb += dut.index.eq(index)
        store = before(m, spi.o_valid & (state == _BURST) & (frame != _LAST), "store")
        place = Signal(3, name="place_asked")
        for k, name in enumerate(WORDS):
            with m.If(self.asked == REGISTERS[name]):
                m.d.comb += place.eq(k)
        heard = self.heard
        value = Mux(place == 6, Cat(heard[:12], heard[11].replicate(4)), heard)
        hit = store & (place == index)
        word = Signal(16, name="word_wanted", reset_less=True)
        is_current = Signal(name="is_ours")
        self.accepted = (state == _EDGE) & self.edge & ~spi.busy
        with m.If(self.accepted):
            m.d.sync += is_current.eq(0)
        with m.If(hit):
            m.d.sync += [word.eq(value), is_current.eq(1)]
        temperature, diag = Signal(16, name="temperature"), Signal(16, name="diag")
        with m.If(store & (place == 6)):
            m.d.sync += temperature.eq(value)
        with m.If(store & (place == 7)):
            m.d.sync += diag.eq(value)
        limit = Mux(place < 3, dut.settings.gyro_limit, dut.settings.accel_limit)
        signed = heard.as_signed()
        self.over = over = Signal(name="is_over")
        with m.If(self.accepted):
            m.d.sync += over.eq(0)
        with m.If(store & (place < 6) & ((signed >= limit) | (signed <= -limit))):
            m.d.sync += over.eq(1)
        stamp, number, edges = (Signal(n, name=s) for n, s in ((32, "at"), (16, "nth"), (16, "n")))
        m.d.sync += edges.eq(edges + (self.running & self.edge))
        with m.If(self.accepted):
            m.d.sync += [stamp.eq(self.time), number.eq(edges)]
        answered_at = Mux(index == 6, 0, Mux(index == 7, 7, index + 1))
        m.d.comb += [
            Assert(dut.word == word),
            Assert(~dut.sample | is_current),
            Assert((dut.temperature == temperature) & (dut.diag_stat == diag)),
            Assert((dut.stamp == stamp) & (dut.number == number)),
            # For induction.
            Assert((state != _BURST) | (frame <= answered_at) | is_current),
            Assert((state != _BURST) | (Mux(frame == 0, 0, self.inside["over"]) == over)),
            Assert(self.inside["edges"] == edges),
            Assert(self.inside["storing"] == store),
            Assert(~store | (self.inside["place"] == place)),
            Assert(~store | ~self.framing | self.out),
        ]
        settings = dut.settings
        self.invalid = (diag & settings.invalid_mask).any()
        self.alarm = (diag & settings.alarm_mask).any()
        status_open = (state != _BURST) | (frame < 8)
        m.d.comb += Assert(status_open | (self.inside["invalid"] == self.invalid))
        m.d.comb += Assert(status_open | (self.inside["alarm"] == self.alarm))

    def _judge(self, m: Module) -> None:
        """Events and flags, each as its meaning says; when the reader starts again."""
        dut, state, inside = self.dut, self.state, self.inside
        judged, right, which = self.judged, self.right, self.which
        bad_limit = dut.settings.bad_limit
        checked = judged | self.start_check
        names = ("identity_error", "config_error", "no_data_ready", "link_error", "alarm")
        flag = {n: Signal(name=f"flag_{n}") for n in (*names, "over_range", "overrun")}
        doubt, skipped = Signal(name="last_was_wrong"), Signal(name="was_skipped")
        count = Signal(range(bad_limit + 1), name="bad_ones")
        good = judged & right & ~self.invalid & ~doubt
        missing = (state == _EDGE) & self.expired & ~self.accepted
        bad = missing | (judged & (~right | self.invalid))
        overrun = self.edge & self.running & ~self.accepted
        restart = dut.restart | (bad & (count == bad_limit - 1)) | (self.start_check & ~right)
        event = {
            "sample": good,
            "identity_error": checked & (which == 0) & ~right,
            "config_error": checked & (which != 0) & ~right,
            "no_data_ready": missing,
            "link_error": judged & right & (self.invalid | doubt),
            "alarm": good & self.alarm,
            "over_range": good & self.over,
            "overrun": overrun,
            "restart": dut.enable & restart,
        }
        m.d.comb += self.start_over.eq(~dut.enable | restart)
        with m.If(checked):
            m.d.sync += doubt.eq(~right)
            m.d.sync += Mux(which == 0, flag["identity_error"], flag["config_error"]).eq(~right)
        with m.If(judged & right):
            m.d.sync += flag["link_error"].eq(self.invalid | doubt)
        with m.If(self.accepted | missing):
            m.d.sync += flag["no_data_ready"].eq(missing)
        with m.If(good):
            m.d.sync += [flag["alarm"].eq(self.alarm), flag["over_range"].eq(self.over)]
            m.d.sync += [flag["overrun"].eq(skipped), skipped.eq(0)]
        with m.If(overrun):
            m.d.sync += skipped.eq(1)
        with m.If(bad):
            m.d.sync += count.eq(count + 1)
        with m.If(good | (state == _RESET)):
            m.d.sync += count.eq(0)
        happened = Cat(event[name] for name in EVENTS)
        flags = Cat(self.running if name == "running" else flag[name] for name in FLAGS.members)
        identity, config = flag["identity_error"], flag["config_error"]
        started = (state == _START) & (self.frame > 1)
        m.d.comb += [
            Assert(dut.events == before(m, happened, "happened")),
            Assert(dut.sample == before(m, good, "good")),
            Assert(dut.flags.as_value() == flags),
            # For induction.
            Assert(~self.running | (doubt == (identity | config))),
            Assert(~(self.running & identity) | (self.turn == 0)),
            Assert(~(self.running & config) | (self.turn != 0)),
            Assert(~started | ~identity),
            Assert(~started | (self.frame < 10) | ~doubt),
            Assert(~started | (self.frame < 11) | ~config),
            Assert(inside["skipped"] == skipped),
            Assert((state == _RESET) & self.begins | (inside["chances"] == bad_limit - 1 - count)),
            Assert((state == _RESET) & self.begins | (inside["final"] == (count == bad_limit - 1))),
            Assert((state == _RESET) | (count < bad_limit)),
        ]
        self.good, self.missing, self.bad, self.doubt, self.count = good, missing, bad, doubt, count

    def _states(self, m: Module) -> None:
        """Reset pulse, wait, start, then data-ready and sample in turn."""
        dut, spi, state, frame, inside = self.dut, self.dut.spi, self.state, self.frame, self.inside
        expired, turn = self.expired, self.turn
        resets = state == _RESET
        m.d.sync += self.begins.eq(self.start_over | self.reply | self.missing | (resets & expired))
        with m.If(resets):
            m.d.sync += [
                used.eq(getattr(dut, name))
                for used, name in zip(self.used, ("msc_ctrl", "smpl_prd", "sens_avg"), strict=True)
            ]
        with m.If(resets & expired):
            m.d.sync += state.eq(_STARTUP)
        with m.If((state == _STARTUP) & expired & ~spi.busy):
            m.d.sync += state.eq(_START)
        with m.If(self.accepted):
            m.d.sync += state.eq(_BURST)
        with m.If(self.reply):
            m.d.sync += frame.eq(frame + 1)
        with m.If(self.reply & (frame == Mux(state == _START, _LAST_START, _LAST))):
            m.d.sync += [state.eq(_EDGE), frame.eq(0)]
        with m.If(self.judged & self.right):
            m.d.sync += turn.eq(turn + 1)
        with m.If(self.start_over):
            m.d.sync += [state.eq(_RESET), frame.eq(0)]
        m.d.comb += [
            Assert(dut.reset_n == before(m, ~resets, "was_up")),
            reached(m, dut.sample if spi.quick else (state == _START) & (frame == 2), "came"),
            # For induction.
            *(Assert(~(state == k) | inside.state(n)) for k, n in enumerate(_NAMES)),
            *(
                Assert(inside[f"{n}_used"] == u)
                for n, u in zip(("msc_ctrl", "smpl_prd", "sens_avg"), self.used, strict=True)
            ),
            Assert(inside["running"] == self.running),
            Assert(inside["checking"] == turn),
            Assert(inside["answered"] == self.reply),
            Assert(~self.reply | self.framing),
        ]


class Recovered(Sampled):
    """A sample comes, whatever the state in which the device begins to work.

    From some cycle on the device answers to each frame what the one before asked for: its identity,
    the settings that were last written to it (before: any), a status without the bits that make
    samples invalid. No wait that begins then ends without a data-ready edge; the reader is enabled
    and not told to restart.

    Parameters
    ----------
    dut : Adis16385
        Component, as of `scaled`.
    """

    def _surroundings(self, m: Module) -> None:
        """The device, and since when it works."""
        dut, spi, state = self.dut, self.dut.spi, self.state
        quick = spi.quick
        self.works = works = Signal(name="works", init=quick)
        m.d.sync += works.eq(works | unknown(m, 1, "begins_to_work"))
        answer = unknown(m, BITS, "answer")
        self.kept = kept = Signal(48, name="kept")
        # Commands that the device has got, and not forgotten in a reset.
        self.got, self.got_before = Signal(name="got"), Signal(name="got_before")
        resets = state <= _STARTUP
        with m.If(self.takes):
            m.d.sync += [self.got.eq(works), self.got_before.eq(self.got)]
        with m.If(resets):
            m.d.sync += [self.got.eq(0), self.got_before.eq(0)]
        with m.If(~works | resets | (spi.o_valid & ~self.got)):
            m.d.sync += kept.eq(unknown(m, 48, "whatever"))
        with m.Elif(spi.o_valid & self.sent[15]):
            for k in range(6):
                with m.If(self.sent[8:15] == REGISTERS["MSC_CTRL"] + k):
                    m.d.sync += kept[8 * k : 8 * k + 8].eq(self.sent[:8])
        contents = Signal(BITS, name="contents")
        m.d.comb += contents.eq(answer)
        with m.Switch(self.asked):
            with m.Case(REGISTERS["PROD_ID"]):
                m.d.comb += contents.eq(dut.settings.identity)
            with m.Case(REGISTERS["DIAG_STAT"]):
                m.d.comb += contents.eq(answer & ~dut.settings.invalid_mask)
            for k, name in enumerate(CHECKED[1:]):
                with m.Case(REGISTERS[name]):
                    m.d.comb += contents.eq(kept[16 * k : 16 * k + 16])
        m.d.comb += [
            spi.answer.eq(Mux(works & self.got_before, contents, answer)),
            dut.enable.eq(works | unknown(m, 1, "enable_in")),
            dut.restart.eq(~works & unknown(m, 1, "restart_in")),
        ]

    def _states(self, m: Module) -> None:
        """The bounds, and their induction."""
        super()._states(m)
        dut, works, state, frame = self.dut, self.works, self.state, self.frame
        limit = dut.settings.bad_limit
        equal = Array([Const(1), *(self.kept.word_select(k, 16) == self.used[k] for k in range(3))])
        again, whole, waits = Signal(name="again"), Signal(name="whole"), Signal(name="waits")
        bad, linked = Signal(range(limit + 2), name="bad_since"), Signal(2, name="linked")
        link = self.judged & self.right & ~self.good & ~self.invalid
        with m.If(works & self.bad):
            m.d.sync += bad.eq(bad + 1)
        with m.If(works & link):
            m.d.sync += linked.eq(linked + 1)
        with m.If(self.good):
            m.d.sync += [bad.eq(0), linked.eq(0)]
        with m.If(works & self.start_over):
            m.d.sync += [again.eq(1), bad.eq(0), linked.eq(0)]
        with m.If(self.accepted):
            m.d.sync += whole.eq(works)
        with m.If(self.reply | self.missing):
            m.d.sync += waits.eq(works)
        m.d.comb += [
            # A data-ready edge is in time.
            Assume(~(self.missing & waits)),
            # The claims.
            Assert(~(works & self.start_over) | ~again),
            Assert(bad + linked <= limit),
            Assert(~again | ~(self.bad | link)),
            # For induction.
            Assert(bad <= Mux(self.running, self.count, 0)),
            Assert(self.running | (linked == 0)),
            Assert(linked <= 1),
        ]
        burst, edge = state == _BURST, state == _EDGE
        right_setting = equal[self.turn]
        started = (state == _START) & again
        m.d.comb += [
            Assert(works | (~again & ~whole & ~waits & (bad == 0) & (linked == 0))),
            Assert(~whole | works),
            Assert(~self.got | works),
            Assert(~self.got_before | works),
            Assert(~(edge & (again | (linked != 0) | (bad != 0))) | waits),
            Assert(~(burst & (again | (linked != 0) | (bad != 0))) | whole),
            Assert(~(burst & whole & self.out) | (self.got & ((frame == 0) | self.got_before))),
            Assert(~(burst & whole & (frame != 0)) | self.got),
            Assert(~(burst & whole & (frame == 8)) | ~self.invalid),
            Assert(~(works & self.judged & whole) | (self.right == right_setting)),
            Assert((linked == 0) | ~self.doubt | ~right_setting),
            Assert(~(again & self.running) | (equal[1] & equal[2] & equal[3] & ~self.doubt)),
            Assert(~(started & self.out) | (self.got & ((frame == 0) | self.got_before))),
            Assert(~(started & (frame != 0)) | self.got),
            *(
                Assert(
                    ~(started & (frame > 2 + k))
                    | (self.kept[8 * k : 8 * k + 8] == self.used[k // 2][8 * (k % 2) :][:8])
                )
                for k in range(6)
            ),
        ]


def _proof(name: str, claim: str, harness: type[Sampled], *, quick: bool = False) -> Proof:
    return Proof(
        name=f"inertial.{name}",
        depth=4,
        induction=3,
        cover=range(135, 136) if quick else range(32, 33),
        short=not quick,
        reset=not quick,
        claim=f"Adis16385, {claim}",
        harness=lambda: harness(scaled(quick=quick)),
    )


_RECOVERS = (
    "with a device that works from some cycle on, in any state of both: from then on there is at "
    "most one new start, with it at most `bad_limit` and one more samples in a row are dropped or "
    "missing, and after it every sample is good"
)
PROOFS = (
    _proof(
        "samples",
        "any answers, data-ready, settings and orders: frames are sent as listed, without a pause; "
        "each word is the answer to the frame that asked for it, and of the sample's own burst, as "
        "are stamp and number; a sample comes once, if all its checks are right; events and flags "
        "are what they say; waits end with the tick after so many; after `bad_limit` bad samples, "
        "a start given up or on request the reader starts again",
        Sampled,
    ),
    _proof("recovers", _RECOVERS, Recovered),
    _proof("first_sample", f"the shortest frames, no reset: {_RECOVERS}", Recovered, quick=True),
)
