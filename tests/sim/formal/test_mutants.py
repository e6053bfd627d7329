"""The proofs bite: each refutes a component that is broken in one place."""

from dataclasses import replace

import pytest
from amaranth.lib.crc import catalog

import boresight.gateware.boards.framer
import boresight.gateware.boards.unpack
import boresight.gateware.bus.arbiter
import boresight.gateware.bus.axi_lite
import boresight.gateware.bus.axi_stream
import boresight.gateware.bus.core_registers
import boresight.gateware.bus.csr
import boresight.gateware.bus.results
import boresight.gateware.bus.wishbone
import boresight.gateware.engine.sequencer
import boresight.gateware.serial.uart
import boresight.gateware.system.system_bus
from boresight.gateware.machine import CONFIGS
from boresight.sim.formal.blocks import (
    axi,
    bus,
    crc,
    frames,
    registers,
    results,
    sequencer,
    system_bus,
    uart,
    uart_loop,
)
from boresight.sim.formal.prove import Proof, prove
from boresight.sim.formal.registry import find_proofs


def refuted(name: str, harness, *, depth: int | None = None) -> bool:
    """Whether the proof of that name refutes the harness by a run from power-up."""
    (proof,) = find_proofs([name])
    assert isinstance(proof, Proof)
    result = prove(replace(proof, harness=harness, depth=depth or proof.depth))
    return result.refuted and result.trace is not None


@pytest.mark.parametrize(
    "old, new",
    [
        # A word without ``valid`` is no word.
        (
            "rest.eq(Mux(begin, Cat(self.i.payload, Const(1, 1)), rest[1:]))",
            "rest.eq(Mux(empty, Cat(self.i.payload, self.i.valid), rest[1:]))",
        ),
        ("self.tx.eq(Mux(empty, ~self.i.valid, rest[0]))", "self.tx.eq(~empty & rest[0])"),
        ("wait = (1 - self.divisor)", "wait = (2 - self.divisor)"),
    ],
)
def test_transmitter(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.serial.uart, old, new)
    assert refuted("uart.sent_9", lambda: uart.Sent(broken.Transmitter(divisor=9)), depth=30)


@pytest.mark.parametrize(
    "old, new",
    [
        ("bits.eq(Cat(bits[1:], line))", "bits.eq(Cat(line, bits[1:]))"),
        ("m.d.comb += after(self.to_middle)", "m.d.comb += after(divisor)"),
    ],
)
def test_receiver(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.serial.uart, old, new)
    assert refuted(
        "uart.loop_8",
        lambda: uart_loop.Loop(
            boresight.gateware.serial.uart.Transmitter(divisor=8), broken.Receiver(divisor=8)
        ),
        depth=40,
    )


def test_other_crc() -> None:
    assert refuted("crc.frames", lambda: crc.AgainstShifts(catalog.CRC16_KERMIT(data_width=8)))


@pytest.mark.parametrize(
    "old, new",
    [
        (
            "special.eq(~literal & ((byte == END) | (byte == ESC)))",
            "special.eq(~literal & (byte == END))",
        ),
        ("byte.eq(crc.crc[8:])", "byte.eq(crc.crc[:8])"),
    ],
)
def test_framer(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.boards.framer, old, new)
    assert refuted(
        "frames.delivered",
        lambda: frames.Delivered(
            broken.Framer(),
            boresight.gateware.boards.unpack.Unpacker(word=frames.WORD, lengths=frames.LENGTHS),
        ),
        depth=18,
    )


@pytest.mark.parametrize(
    "old, new",
    [
        ("writer.data.eq(Cat(gathered[8:], byte))", "writer.data.eq(Cat(gathered[16:], byte))"),
        ("byte.eq(Mux(self.data == END_ESCAPED, END, ESC))", "byte.eq(self.data)"),
    ],
)
def test_unpacker(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.boards.unpack, old, new)
    assert refuted(
        "frames.delivered",
        lambda: frames.Delivered(
            boresight.gateware.boards.framer.Framer(),
            broken.Unpacker(word=frames.WORD, lengths=frames.LENGTHS),
        ),
        depth=18,
    )


@pytest.mark.parametrize(
    "old, new",
    [
        # Phantom acknowledge; the next write granted with the one before; any number is a program.
        ("bus.w_ack.eq(bus.w_stb & (~waits | self.grant)),", "bus.w_ack.eq(~waits | self.grant),"),
        ("self.request.eq(bus.w_stb & waits & ~self.grant)", "self.request.eq(bus.w_stb & waits)"),
        ("waits.eq(bus.w_data < self.programs)", "waits.eq(1)"),
        ("(UPDATES, updates)", "(UPDATES, updates + self.commit)"),
    ],
)
def test_registers(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.core_registers, old, new)
    assert refuted(
        "registers.fast_3",
        lambda: registers.Bus(broken.Registers(machine=CONFIGS["fast"], digest=1, programs=3)),
    )


@pytest.mark.parametrize(
    "old, new",
    [
        (
            "self.request.eq((bus.w_stb & waits | other) & ~self.grant)",
            "self.request.eq(bus.w_stb & waits & ~self.grant)",
        ),
        ("bus.w_stb & (~waits | self.grant & ~self.switch)", "bus.w_stb & (~waits | self.grant)"),
    ],
)
def test_registers_with_selector(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.core_registers, old, new)
    assert refuted(
        "registers.small_4_selector",
        lambda: registers.Bus(
            broken.Registers(machine=CONFIGS["small"], digest=1, programs=4, selector=True)
        ),
    )


@pytest.mark.parametrize(
    "old, new",
    [
        ("swallow.eq(word.get_last & ~self.i_last)", "swallow.eq(word.get_last)"),
        ("m.d.sync += fill.eq(0)", "m.d.sync += fill.eq(1)"),
        ("claim.eq(self.request & ~started)", "claim.eq(self.request)"),
        ("with m.If(swallow & self.i_valid & self.i_last):", "with m.If(swallow & self.i_valid):"),
        ("pc.eq(Mux(home | self.start, base, pc + 1))", "pc.eq(Mux(home, base, pc + 1))"),
    ],
)
def test_sequencer(old: str, new: str, mutant) -> None:
    broken, machine = mutant(boresight.gateware.engine.sequencer, old, new), CONFIGS["small"]
    assert refuted(
        "sequencer.small",
        lambda: sequencer.Stepped(
            broken.Sequencer(machine=machine, image=sequencer.tiny_image(machine))
        ),
    )


@pytest.mark.parametrize(
    "old, new",
    [
        (
            "~self.request[k] | ~initiator.w_stb | self.bus.w_ack",
            "self.request[k] | ~self.request[k]",
        ),
        ("initiator.w_ack.eq(self.bus.w_ack & self.request[k])", "initiator.w_ack.eq(0)"),
        (
            "with m.If(self.request[(k + after) % self.count]):",
            "with m.If(self.request[(k + after) % self.count] & ~self.request[k]):",
        ),
    ],
)
def test_arbiter(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.arbiter, old, new)
    assert refuted(
        "bus.arbiter_3", lambda: bus.Shared(broken.BusArbiter(count=3, word=4, address=3))
    )


@pytest.mark.parametrize(
    "old, new",
    [
        ("with m.If(~asked & ~fetch & ~wb.ack):", "with m.If(~asked & ~fetch):"),
        ("wanted.eq(wanted & selected)", "wanted.eq(wanted)"),
        ("m.d.sync += [asked.eq(0), fetch.eq(1)]", "m.d.sync += fetch.eq(1)"),
    ],
)
def test_wishbone(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.wishbone, old, new)
    assert refuted("bus.wishbone", lambda: bus.Slave(broken.WishboneSlave()))


@pytest.mark.parametrize(
    "old, new",
    [
        ("csr.w_en.eq(ours & ours_csr)", "csr.w_en.eq(ours)"),
        ("core.w_stb.eq(bus.w_stb & is_core)", "core.w_stb.eq(bus.w_stb)"),
        ("ours.eq(bus.w_stb & ~is_core & ~ours)", "ours.eq(bus.w_stb & ~is_core)"),
    ],
)
def test_system_bus(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.system.system_bus, old, new)
    assert refuted(
        "bus.system",
        lambda: system_bus.Mapped(
            broken.SystemBus(registers=system_bus.registers(), events=system_bus.EVENTS)
        ),
        depth=5,
    )


@pytest.mark.parametrize(
    "old, new",
    [
        ("_free(newest, *banks)", "_free(newest)"),
        ("_free(newest, *banks)", "_free(*banks)"),
        ("r_port.addr.eq(Cat(port.index, bank))", "r_port.addr.eq(Cat(port.index, newest))"),
    ],
)
def test_results(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.results, old, new)
    assert refuted("results.whole_2", lambda: results.Whole(broken.Results(word=2, readers=2)))


@pytest.mark.parametrize(
    "name, old, new",
    [
        ("axi.stream_in", "axi.tready.eq(fifo.w_rdy)", "axi.tready.eq(1)"),
        ("axi.stream_in", "Cat(axi.tdata[: self.word], axi.tlast)", "axi.tdata[: self.word + 1]"),
        ("axi.stream_out", "fifo.r_data[: self.word].as_signed()", "fifo.r_data[: self.word]"),
    ],
)
def test_axi_stream(name: str, old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.axi_stream, old, new)
    kind = broken.StreamFromAxi if name.endswith("in") else broken.StreamToAxi
    assert refuted(name, lambda: axi.Packets(kind(word=4)))


@pytest.mark.parametrize(
    "old, new",
    [
        # A response before the word; one that is overwritten; a write of some bytes that is done; a
        # request before the one before has its word.
        ("aw_full & w_full & ~axi.bvalid", "aw_full & ~axi.bvalid"),
        ("ar_full & ~axi.rvalid", "ar_full"),
        ("written.eq(~strobes.all())", "written.eq(~strobes.any())"),
        ("with m.If(~asked & ~fetch):", "with m.If(~asked):"),
    ],
)
def test_axi_lite(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.bus.axi_lite, old, new)
    assert refuted("axi.lite", lambda: axi.Lite(broken.AxiLiteSlave(word=8, address=3)))
