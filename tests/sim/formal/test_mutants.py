"""The proofs bite: each refutes a component that is broken in one place."""

from dataclasses import replace
from importlib import import_module

import pytest
from amaranth.hdl import Elaboratable
from amaranth.lib.crc import catalog

from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.unpack import Unpacker
from boresight.gateware.machine import CONFIGS
from boresight.gateware.serial.uart import Transmitter
from boresight.gateware.system.conductor import Conductor
from boresight.sim.formal.blocks import (
    accesses,
    attitude_output,
    axi,
    bus,
    commander,
    conductor,
    crc,
    frames,
    lane,
    operands,
    registers,
    results,
    sentence,
    sequencer,
    system_bus,
    uart,
    uart_loop,
)
from boresight.sim.formal.prove import Proof, prove
from boresight.sim.formal.registry import find_proofs

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
UNPACKED = {"word": frames.WORD, "lengths": frames.LENGTHS}
#: Module, proof, the proof's harness around what a broken copy of the module has, depth.
PARTS = {
    "transmitter": (
        *("serial.uart", "uart.sent_9"),
        *(lambda b: uart.Sent(b.Transmitter(divisor=9)), 30),
    ),
    "receiver": (
        *("serial.uart", "uart.loop_8"),
        *(lambda b: uart_loop.Loop(Transmitter(divisor=8), b.Receiver(divisor=8)), 40),
    ),
    "framer": (
        *("boards.framer", "frames.delivered"),
        *(lambda b: frames.Delivered(b.Framer(), Unpacker(**UNPACKED)), 18),
    ),
    "unpacker": (
        *("boards.unpack", "frames.delivered"),
        *(lambda b: frames.Delivered(Framer(), b.Unpacker(**UNPACKED)), 18),
    ),
    "registers": (
        *("bus.core_registers", "registers.fast_3"),
        *(lambda b: registers.Bus(b.Registers(machine=FAST, digest=1, programs=3)), None),
    ),
    "registers with selector": (
        *("bus.core_registers", "registers.small_4_selector"),
        lambda b: registers.Bus(b.Registers(machine=SMALL, digest=1, programs=4, selector=True)),
        None,
    ),
    "sequencer": (
        *("engine.sequencer", "sequencer.small"),
        lambda b: sequencer.Stepped(b.Sequencer(machine=SMALL, image=sequencer.tiny_image(SMALL))),
        None,
    ),
    "arbiter": (
        *("bus.arbiter", "bus.arbiter_3"),
        *(lambda b: bus.Shared(b.BusArbiter(count=3, word=4, address=3)), None),
    ),
    "wishbone": ("bus.wishbone", "bus.wishbone", lambda b: bus.Slave(b.WishboneSlave()), None),
    "system bus": (
        *("system.system_bus", "bus.system"),
        lambda b: system_bus.Mapped(
            b.SystemBus(registers=system_bus.registers(), events=system_bus.EVENTS)
        ),
        5,
    ),
    "results": (
        *("bus.results", "results.whole_2"),
        *(lambda b: results.Whole(b.Results(word=2, readers=2)), None),
    ),
    "packer": (
        *("boards.pack", "packer.records"),
        *(lambda b: accesses.Packed(b.Packer(word=accesses.WORD)), 12),
    ),
    "packer of replies": (
        *("boards.pack", "packer.replies"),
        *(lambda b: accesses.Packed(b.Packer(word=accesses.WORD, records=False)), None),
    ),
    "dispatcher": (
        *("boards.dispatch", "dispatcher.3_1"),
        lambda b: accesses.Dispatched(
            b.Dispatcher(word=accesses.WORD, inputs=3, depth=3, address=5)
        ),
        12,
    ),
    "sentence": (
        *("sensors.hmr3300_sentence", "sentence.grammar"),
        *(lambda b: sentence.Parsed(b.SentenceParser()), 14),
    ),
    "commander": (
        *("sensors.hmr3300_command", "commander.sequences_3_2"),
        *(lambda b: commander.Commanded(b.Commander(timeout_ticks=3, quiet_ticks=2)), 24),
    ),
    "attitude output": (
        *("system.attitude_output", "output.frames_2"),
        *(lambda b: attitude_output.Sent(b.AttitudeOutput(text=False, outputs=2)), 56),
    ),
    "attitude output with lines": (
        *("system.attitude_output", "output.frames_and_lines"),
        *(lambda b: attitude_output.Sent(b.AttitudeOutput()), 20),
    ),
    "conductor": (
        *("system.conductor", "conductor.updates_chain"),
        *(lambda b: conductor.Updates(b.Conductor(plan=conductor.PLANS["chain"], readers=1)), 16),
    ),
    "conductor's watchdog": (
        *("system.conductor", "conductor.watched"),
        *(lambda b: conductor.Watched(b.Conductor(plan=conductor.PLANS["chain"], readers=1)), 135),
    ),
    "conductor's words": (
        *("system.conductor_words", "conductor.updates_fed"),
        *(lambda b: conductor.Updates(_with_words(b)), 26),
    ),
    "conductor's order of words": (
        *("system.conductor_words", "conductor.updates_fed"),
        *(lambda b: _Order(_with_words(b)), 26),
    ),
    "stream in": (
        *("bus.axi_stream", "axi.stream_in"),
        *(lambda b: axi.Packets(b.StreamFromAxi(word=4)), None),
    ),
    "stream out": (
        *("bus.axi_stream", "axi.stream_out"),
        *(lambda b: axi.Packets(b.StreamToAxi(word=4)), None),
    ),
    "axi_lite": (
        *("bus.axi_lite", "axi.lite"),
        *(lambda b: axi.Lite(b.AxiLiteSlave(word=8, address=3)), None),
    ),
    "lane": (
        *("engine.lane", "lane.stages_18_1"),
        *(lambda b: lane.InStages(b.Lane(machine=lane.machine(18))), 9),
    ),
    "operands": (
        *("engine.operands", "operands.small_window_2"),
        *(lambda b: operands.OneWord(b.Operands(**operands.linked("small"))), 5),
    ),
    "operands of two lanes": (
        *("engine.operands", "operands.fast_window_2"),
        *(lambda b: operands.OneWord(b.Operands(**operands.linked("fast"))), 5),
    ),
    "multiplier": (
        *("engine.multiplier", "lane.product_24"),
        *(lambda b: lane.OfPartialProducts(b.Multiplier(word=24)), 5),
    ),
    "multiplier of one slice": (
        *("engine.multiplier", "lane.product_20"),
        *(lambda b: lane.OfOneSlice(b.Multiplier(word=20)), 5),
    ),
}


class _Order(conductor.Updates):
    """The claims about the order of words alone, which a solver refutes sooner."""

    def _update(self, m) -> None:
        pass

    _line = _registers = _sources = _bound = _update


def _with_words(broken) -> Elaboratable:
    """The update controller with words that are broken."""

    class Broken(Conductor):
        def elaborate(self, platform):
            with pytest.MonkeyPatch.context() as patched:
                patched.setattr("boresight.gateware.system.conductor.Words", broken.Words)
                patched.setattr("boresight.gateware.system.conductor.Step", broken.Step)
                return super().elaborate(platform)

    return Broken(plan=conductor.PLANS["fed"], readers=1)


def refuted(name: str, harness, depth: int | None = None) -> bool:
    """Whether the proof of that name refutes the harness by a run from power-up."""
    (proof,) = find_proofs([name])
    assert isinstance(proof, Proof)
    result = prove(replace(proof, harness=harness, depth=depth or proof.depth, induction=0))
    return result.refuted and result.trace is not None


@pytest.mark.parametrize(
    "part, old, new",
    [
        # A word without ``valid`` is no word.
        (
            "transmitter",
            "rest.eq(Mux(begin, Cat(self.i.payload, Const(1)), rest[1:]))",
            "rest.eq(Mux(empty, Cat(self.i.payload, self.i.valid), rest[1:]))",
        ),
        (
            "transmitter",
            "self.tx.eq(Mux(empty, ~self.i.valid, rest[0]))",
            "self.tx.eq(~empty & rest[0])",
        ),
        ("transmitter", "wait = (1 - self.divisor)", "wait = (2 - self.divisor)"),
        ("receiver", "bits.eq(Cat(bits[1:], line))", "bits.eq(Cat(line, bits[1:]))"),
        ("receiver", "m.d.comb += after(self.to_middle)", "m.d.comb += after(divisor)"),
        (
            "framer",
            "special.eq(~literal & ((byte == END) | (byte == ESC)))",
            "special.eq(~literal & (byte == END))",
        ),
        ("framer", "byte.eq(crc.crc[8:])", "byte.eq(crc.crc[:8])"),
        (
            "unpacker",
            "writer.data.eq(Cat(gathered[8:], byte))",
            "writer.data.eq(Cat(gathered[16:], byte))",
        ),
        ("unpacker", "byte.eq(Mux(self.data == END_ESCAPED, END, ESC))", "byte.eq(self.data)"),
        # Phantom acknowledge; the next write granted with the one before; any number is a program.
        (
            "registers",
            "bus.w_ack.eq(bus.w_stb & (~waits | self.grant)),",
            "bus.w_ack.eq(~waits | self.grant),",
        ),
        (
            "registers",
            "self.request.eq(bus.w_stb & waits & ~self.grant)",
            "self.request.eq(bus.w_stb & waits)",
        ),
        ("registers", "waits.eq(bus.w_data < self.programs)", "waits.eq(1)"),
        ("registers", "(UPDATES, updates)", "(UPDATES, updates + self.commit)"),
        (
            "registers with selector",
            "self.request.eq((bus.w_stb & waits | other) & ~self.grant)",
            "self.request.eq(bus.w_stb & waits & ~self.grant)",
        ),
        (
            "registers with selector",
            "bus.w_stb & (~waits | self.grant & ~self.switch)",
            "bus.w_stb & (~waits | self.grant)",
        ),
        ("sequencer", "swallow.eq(word.get_last & ~self.i_last)", "swallow.eq(word.get_last)"),
        ("sequencer", "m.d.sync += fill.eq(0)", "m.d.sync += fill.eq(1)"),
        ("sequencer", "claim.eq(self.request & ~started)", "claim.eq(self.request)"),
        (
            "sequencer",
            "with m.If(swallow & self.i_valid & self.i_last):",
            "with m.If(swallow & self.i_valid):",
        ),
        (
            "sequencer",
            "pc.eq(Mux(home | self.start, base, pc + 1))",
            "pc.eq(Mux(home, base, pc + 1))",
        ),
        (
            "arbiter",
            "~self.request[k] | ~initiator.w_stb | self.bus.w_ack",
            "self.request[k] | ~self.request[k]",
        ),
        (
            "arbiter",
            "initiator.w_ack.eq(self.bus.w_ack & self.request[k])",
            "initiator.w_ack.eq(0)",
        ),
        (
            "arbiter",
            "with m.If(self.request[(k + after) % self.count]):",
            "with m.If(self.request[(k + after) % self.count] & ~self.request[k]):",
        ),
        ("wishbone", "~fetch.any() & ~wb.ack):", "~fetch.any()):"),
        ("wishbone", "wanted.eq(wanted & selected)", "wanted.eq(wanted)"),
        ("wishbone", "m.d.sync += [asked.eq(0), fetch.eq(1)]", "m.d.sync += fetch.eq(1)"),
        ("system bus", "bus.w_stb & is_csr & ~ours", "bus.w_stb & ~ours"),
        ("system bus", "core.w_stb.eq(bus.w_stb & is_core)", "core.w_stb.eq(bus.w_stb)"),
        ("system bus", "ours.eq(bus.w_stb & ~is_core & ~ours)", "ours.eq(bus.w_stb & ~is_core)"),
        ("results", "_free(newest, *banks)", "_free(newest)"),
        ("results", "_free(newest, *banks)", "_free(*banks)"),
        (
            "results",
            "r_port.addr.eq(Cat(port.index, bank))",
            "r_port.addr.eq(Cat(port.index, newest))",
        ),
        # A reply in a record; bytes in another order; a reply that is taken early.
        ("packer", 'm.next = "NEXT"\n', 'm.next = "IDLE"\n'),
        ("packer", "held.as_signed()", "held"),
        ("packer", "sent & whole & answer", "sent & answer"),
        ("packer of replies", "self.o.ready & whole & ~head", "self.o.ready & ~head"),
        # Records in the core; the address for the word; a write that is not waited for; its reply.
        ("dispatcher", "self.pending & (~busy | record)", "self.pending"),
        ("dispatcher", "self.index.eq(1)", "self.index.eq(0)"),
        ("dispatcher", 'm.State("WRITE"), m.If(bus.w_ack)', 'm.State("WRITE")'),
        ("dispatcher", "self.kind == Kind.WRITE, self.bus", "self.kind == Kind.READ, self.bus"),
        ("dispatcher", "self.index == self.inputs - 1", "self.index == self.inputs - 2"),
        # Two numbers of three; one that is too large, or long; a point too late; a spoilt line.
        ("sentence", 'byte["cr"] & field[1] & ~over', 'byte["cr"] & ~over'),
        ("sentence", "~field[1] & ~over", "~field[1]"),
        ("sentence", "count != DIGITS_MAX", "count != DIGITS_MAX + 1"),
        ("sentence", "count <= WHOLE_MAX", "count <= WHOLE_MAX + 1"),
        ("sentence", "m.Elif(error | (self.pause & ~at_begin))", "m.Elif(self.pause & ~at_begin)"),
        # An effect and a time-out at once; a user's letter that is lost; no start; a pause that is
        # early, and one that is short; silence while it speaks itself.
        ("commander", "m.Elif(expired | self.invalid)", "m.If(expired | self.invalid)"),
        ("commander", "at.manual & (left == 3)", "(left == 3)"),
        ("commander", "go_to(Stage.START, command=True)", "go_to(Stage.START)"),
        ("commander", "at.tries == TRIES - 1", "at.tries == TRIES - 2"),
        ("commander", "m.If(self.heard | sending)", "m.If(self.heard)"),
        # Another update in the middle; a frame without end; other bytes; a pace; other updates.
        ("attitude output", "start.eq(due & idle)", "start.eq(due)"),
        ("attitude output", "Const(3, 2), s.last", "Const(2, 2), s.last"),
        ("attitude output", "~word.any() & s.code[1:3].all()", "s.code[1:3].all()"),
        ("attitude output", "s.next_place.eq(4 << self.bits)", "s.next_place.eq(5 << self.bits)"),
        ("attitude output", "later = left[1:].any()", "later = left.any()"),
        ("attitude output with lines", "raw.eq(s.text)", "raw.eq(0)"),
        ("attitude output with lines", "Mux(is_text, _State.FETCH, _State.KIND)", "_State.KIND"),
        # A word after the last; a line that is not used leaves its words to one that waits; an
        # update that begins late; a watchdog that waits for ever, or half the time.
        ("conductor", "s.offer.eq(self.chosen & ~(fire & s.ends))", "s.offer.eq(self.chosen)"),
        ("conductor", "with m.If(self.line):", "with m.If(accepted):"),
        ("conductor", "results.begin.eq(s.begin)", "results.begin.eq(s.complete)"),
        ("conductor's watchdog", "(once | change) & ~done", "(once | change) & done"),
        ("conductor's watchdog", "late.eq(once & change)", "late.eq(change)"),
        # Words that come when the record before has been aborted; sources of words; places.
        ("conductor's order of words", "o.valid & (s.job == Job.FILTER)", "o.valid"),
        ("conductor's words", "Mux(s.count[0], Source.LINE, Source.STAMP)", "Source.STAMP"),
        ("conductor's words", '== RAW.index("stamp")),', "== 0),"),
        ("stream in", "axi.tready.eq(fifo.w_rdy)", "axi.tready.eq(1)"),
        ("stream in", "Cat(axi.tdata[: self.word], axi.tlast)", "axi.tdata[: self.word + 1]"),
        ("stream out", "fifo.r_data[: self.word].as_signed()", "fifo.r_data[: self.word]"),
        # A response before the word; one that is overwritten; a write of some bytes that is done; a
        # request before the one before has its word.
        ("axi_lite", "aw_full & w_full & ~axi.bvalid", "aw_full & ~axi.bvalid"),
        ("axi_lite", "ar_full & ~axi.rvalid", "ar_full"),
        ("axi_lite", "written.eq(~strobes.all())", "written.eq(~strobes.any())"),
        ("axi_lite", "with m.If(~asked & ~fetch):", "with m.If(~asked):"),
        # One stage each: capture, mask, condition, amount, term, sum, clamp.
        ("lane", "top[-1] ^ (self.quarter & top[-2])", "top[-1] ^ self.quarter"),
        ("lane", "high & ~masked.replicate(len(high))", "high & ~masked"),
        ("lane", "skip[k].eq(skip[k - 1])", "skip[k].eq(~(self.when ^ (self.when_flag & flag)))"),
        ("lane", "less.eq(n & ~1)", "less.eq(n)"),
        ("lane", "carry.eq(invert & ~skip)", "carry.eq(invert)"),
        ("lane", "half = 1 << (arith.guard - 1)", "half = 1 << arith.guard"),
        ("lane", "over = q[-1], q[word - 1 : -1]", "over = q[-1], q[word:-1]"),
        ("operands", "offset[-2] ^ (parity & state)", "offset[-2] ^ parity"),
        ("operands", "Mux(slot[high - 1 :].all(), owner, self.parity)", "owner"),
        ("operands", "Cat(~field[2], field[2] ^ field[3])", "Cat(~field[2], field[3])"),
        ("operands of two lanes", "bank_select.eq(field[3])", "bank_select.eq(field[2])"),
        (
            "operands of two lanes",
            "self._state(self.w_addr[lane], self.parity)",
            "self._state(self.w_addr[0], self.parity)",
        ),
        ("multiplier", "hl.c.eq(ll.m[cut:])", "hl.c.eq(ll.m[cut - 1 :])"),
        ("multiplier", "low_next.eq(low)", "low_next.eq(ll.m[:cut])"),
        ("multiplier of one slice", "(parts[0] << low)", "(parts[0] << 1)"),
        ("multiplier of one slice", "rows.append(row << k)", "rows.append(row)"),
    ],
)
def test_broken_in_one_place(part: str, old: str, new: str, mutant) -> None:
    module, proof, harness, depth = PARTS[part]
    broken = mutant(import_module(f"boresight.gateware.{module}"), old, new)
    assert refuted(proof, lambda: harness(broken), depth)


def test_other_crc() -> None:
    assert refuted("crc.frames", lambda: crc.AgainstShifts(catalog.CRC16_KERMIT(data_width=8)))
