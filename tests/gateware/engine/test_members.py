"""The ports of every component are those that its documentation says: direction and bits."""

import importlib
import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from amaranth.hdl import Shape, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Member, Out, Signature

from boresight.gateware.attitude.bus.arbiter import BusArbiter
from boresight.gateware.attitude.bus.counters import EventCounters
from boresight.gateware.attitude.bus.feed_registers import FeedRegisters
from boresight.gateware.attitude.bus.results import ResultPort, Results
from boresight.gateware.attitude.bus.stream_buffer import StreamBuffer
from boresight.gateware.attitude.bus.wishbone import WishboneSignature, WishboneSlave
from boresight.gateware.attitude.sensors.adis16385 import Adis16385
from boresight.gateware.attitude.sensors.adis16385_flags import FLAG_MEANINGS
from boresight.gateware.attitude.sensors.hmr3300 import FLAGS, Hmr3300
from boresight.gateware.attitude.sensors.hmr3300_command import Commander
from boresight.gateware.attitude.sensors.hmr3300_number import DecimalNumber
from boresight.gateware.attitude.sensors.hmr3300_sentence import SentenceParser
from boresight.gateware.attitude.sensors.spi import SpiController
from boresight.gateware.attitude.soc.attitude_soc import AttitudeSoc
from boresight.gateware.attitude.soc.bus import ProcessorBus
from boresight.gateware.attitude.soc.control import Control
from boresight.gateware.attitude.soc.cpu import Cpu
from boresight.gateware.attitude.soc.memory import Ram
from boresight.gateware.attitude.soc.system import Soc
from boresight.gateware.attitude.system.attitude_core import AttitudeCore
from boresight.gateware.attitude.system.attitude_output import AttitudeOutput
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.attitude_text import AngleDigits
from boresight.gateware.attitude.system.bridge import Bridge
from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.programs import core_plan, system_core
from boresight.gateware.attitude.system.system_bus import SystemBus
from boresight.gateware.boards.dispatch import Dispatcher
from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.frames import Kind
from boresight.gateware.boards.pack import Packer
from boresight.gateware.boards.top import Top
from boresight.gateware.boards.uart import Receiver, Transmitter
from boresight.gateware.boards.unpack import Unpacker
from boresight.gateware.bus.axi_core import AxiCore
from boresight.gateware.bus.axi_lite import AxiLiteSignature, AxiLiteSlave
from boresight.gateware.bus.axi_stream import AxiStreamSignature, StreamFromAxi, StreamToAxi
from boresight.gateware.bus.core_registers import Registers
from boresight.gateware.bus.csr import Csr, offset_bits
from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.core import build_core
from boresight.gateware.engine.bitwise import Bitwise
from boresight.gateware.engine.dsp48a1 import DSP48A1
from boresight.gateware.engine.engine import Engine, word_layout
from boresight.gateware.engine.lane import Lane
from boresight.gateware.engine.leading import LeadingSignCount
from boresight.gateware.engine.multiplier import Multiplier
from boresight.gateware.engine.operands import Operands
from boresight.gateware.engine.sequencer import Sequencer
from boresight.gateware.engine.shifter import Shifter
from tests.support.linked import linked_core

GATEWARE = Path(__file__).parents[3] / "gateware"
#: ``a, b : In(W)``, several on a line; directions alone; arrays.
ITEM = re.compile(
    r"(?P<names>\w+(?:, \w+)*) : (?P<flow>In|Out)\b"
    r"(?:\((?P<what>(?:[^()]|\([^()]*\))*)\))?(?P<array> array)?"
)


#: Signatures of ports, as documentation names them.
SIGNATURES = {
    kind.__name__: kind
    for kind in (
        AxiLiteSignature,
        AxiStreamSignature,
        BusSignature,
        ProcessorBus,
        ResultPort,
        WishboneSignature,
    )
}
#: Their documentation refers to that of others, or of registers.
IN_OTHER_WORDS = {AttitudeCore, AttitudeSoc, AttitudeSystem, Csr, Lane, SystemBus}


@dataclass(frozen=True)
class Documented:
    """A port as the documentation has it; ``what`` is its shape, or nothing."""

    name: str
    flow: Any
    what: str
    array: bool


@dataclass(frozen=True)
class Case:
    """A component or signature, and what the letters in its documentation stand for."""

    part: Component | Signature
    letters: Mapping[str, Any] = field(default_factory=dict)


def documented(kind: type) -> Iterator[Documented]:
    """The ports under ``Members``."""
    _, _, members = (inspect.getdoc(kind) or "").partition("Members\n-------\n")
    members, _, _ = members.partition("\nParameters\n-----")
    for line in members.splitlines():
        for item in ITEM.finditer(line) if not line.startswith(" ") else ():
            for name in item["names"].split(", "):
                flow = In if item["flow"] == "In" else Out
                yield Documented(name, flow, item["what"] or "", bool(item["array"]))


def shape_of(what: str, letters: Mapping[str, Any]) -> Shape:
    """Of ``W``, ``signed(18)``, ``{data: 8, last: 1}``."""
    if what.startswith("{"):
        what = " + ".join(row.partition(": ")[2] for row in what[1:-1].split(", "))
    return Shape.cast(eval(what, {"signed": signed, **letters}))


def check(port: Documented, member: Member, letters: Mapping[str, Any]) -> None:
    """Raise if the port is another one."""
    assert member.flow == port.flow, port
    assert bool(member.dimensions) == port.array, port
    if member.is_signature:
        name, _, payload = port.what.partition(" of ")
        signature = member.signature.flip() if member.flow == In else member.signature
        if isinstance(signature, stream.Signature):
            assert name == "stream", port
            if payload:
                wanted = shape_of(payload, letters).width
                assert Shape.cast(signature.members["payload"].shape).width == wanted, port
        else:
            what = port.what if "(" in port.what else f"{port.what}()"
            wanted = eval(what, {**SIGNATURES, **letters})
            assert type(signature) is type(wanted) and signature.members == wanted.members, port
    elif port.what:
        wanted, result = shape_of(port.what, letters), Shape.cast(member.shape)
        assert result.width == wanted.width, port
        assert result.signed or not wanted.signed, port


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    """One of each kind, by its name."""
    core = system_core(("complementary", "mekf"), restarts=0)
    plain, linked = build_core(core.parts[0].program, "small", restarts=0), linked_core()
    machine, image = core.machine, core.image
    word, plan = machine.arithmetic.word, core_plan(core)
    system = AttitudeSystem(core=core, wishbone=True)
    events = len(system.events)
    word_of = core.parts[0].program.values[0]
    fed = replace(plan, feed=replace(plan.feed, registers={"target": word_of}))
    lane = {"machine": machine, "image": image}
    w = {"W": word}
    rows = (
        Case(Bitwise(function=lambda a, b: a & b, inputs=2, width=5), {"width": 5}),
        Case(Dispatcher(word=30, inputs=3, depth=4, address=9), {"W": 30, "A": 9}),
        Case(Framer()),
        Case(Packer(word=30), {"W": 30}),
        Case(Top(core=plain, clock_hz=100e6)),
        Case(
            Unpacker(word=30, lengths={Kind.WRITE: 2, Kind.READ: 9}),
            {"W": 30, "depth": 16, "range": range},
        ),
        Case(DSP48A1()),
        Case(Engine(**lane, selector=True), w),
        Case(Lane(machine=machine), w),
        Case(LeadingSignCount(arithmetic=machine.arithmetic), w),
        Case(Multiplier(word=27), {"W": 27}),
        Case(
            Operands(machine=linked.machine, image=linked.image),
            {
                "W": 32,
                "register": linked.machine.register_bits,
                "offset": range(linked.machine.bank_depth),
                "owners": 2,
            },
        ),
        Case(BusSignature(word=30, address=11), {"W": 30, "A": 11}),
        Case(Registers(machine=machine, digest=1, programs=5, selector=True), w),
        Case(Adis16385(clock_hz=100e6), {"FLAGS": FLAG_MEANINGS, "EVENTS": Adis16385.EVENTS}),
        Case(Hmr3300(clock_hz=100e6), {"FLAGS": FLAGS, "EVENTS": Hmr3300.EVENTS}),
        Case(Commander(timeout_ticks=20, quiet_ticks=5)),
        Case(DecimalNumber(angle_max=900)),
        Case(SentenceParser()),
        Case(Sequencer(**lane), {"lanes": machine.lanes, "layout": machine.word_bits}),
        Case(SpiController(half_cycles=4, stall_cycles=10)),
        Case(Receiver(divisor=8)),
        Case(Transmitter(divisor=8)),
        Case(
            Shifter(width_in=40, width_out=33, registered=True), {"width_in": 40, "width_out": 33}
        ),
        Case(AttitudeSoc(system=system)),
        Case(ProcessorBus(addr_width=12), {"addr_width": 12}),
        Case(Control(divisor=8, watchdog_cycles=1024, pages=24)),
        Case(Cpu()),
        Case(Ram(words=1024)),
        Case(Soc(words=1024, divisor=8)),
        Case(AttitudeCore(core=core), w),
        Case(AttitudeOutput()),
        Case(system),
        Case(AngleDigits()),
        Case(Bridge(clock_hz=100e6, address=9), {"A": 9}),
        Case(AxiCore(word=24)),
        Case(StreamBuffer(layout=word_layout(30))),
        Case(AxiLiteSignature(address=9), {"A": 9}),
        Case(AxiLiteSlave(word=24, address=9), {"W": 24, "A": 9}),
        Case(AxiStreamSignature()),
        Case(StreamFromAxi(word=24), {"W": 24}),
        Case(StreamToAxi(word=24), {"W": 24}),
        Case(BusArbiter(count=3, word=30, address=9), {"count": 3, "W": 30, "A": 9}),
        Case(Conductor(plan=fed), w),
        Case(FeedRegisters(word=30, init=(1, 2)), {"W": 30}),
        Case(EventCounters(count=5, bits=20), {"count": 5, "bits": 20}),
        Case(Csr(system.registers), {"registers": system.registers, "offset_bits": offset_bits}),
        Case(ResultPort(word=30), {"W": 30}),
        Case(Results(word=30), {"W": 30}),
        Case(SystemBus(registers=system.registers, events=events, feed=3), {"events": events}),
        Case(WishboneSignature(address=9), {"A": 9}),
        Case(WishboneSlave(address=9), {"A": 9}),
    )
    return {type(case.part).__name__: case for case in rows}


def kinds() -> list[type]:
    """All components and signatures of the hardware."""
    results = []
    for path in sorted(GATEWARE.rglob("*.py")):
        name = ".".join(("boresight.gateware", *path.relative_to(GATEWARE).with_suffix("").parts))
        module = importlib.import_module(name.removesuffix(".__init__"))
        results += [
            kind
            for kind in vars(module).values()
            if inspect.isclass(kind)
            and issubclass(kind, (Component, Signature))
            and kind.__module__ == module.__name__
        ]
    return results


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.__name__)
def test_ports_are_the_documented_ones(kind: type, cases: dict[str, Case]) -> None:
    case = cases[kind.__name__]
    part = case.part
    members = (part if isinstance(part, Signature) else part.signature).members
    ports = list(documented(kind))
    letters = {"len": len, **case.letters}
    for port in ports:
        assert port.name in members, port
        check(port, members[port.name], letters)
    missing = members.keys() - {port.name for port in ports}
    assert not missing or kind in IN_OTHER_WORDS, missing


@pytest.mark.parametrize("kind", [AxiLiteSlave, Bridge, Dispatcher, WishboneSlave])
def test_an_only_initiator_has_the_grant(kind: type, cases: dict[str, Case]) -> None:
    part = cases[kind.__name__].part
    assert isinstance(part, Component) and part.signature.members["grant"].init == 1
