"""Harnesses around a component: free inputs, past values, streams, covers, registers inside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from amaranth.asserts import AnyConst, AnySeq
from amaranth.hdl import (
    Array,
    Assert,
    Assume,
    Cat,
    Const,
    Cover,
    Elaboratable,
    Fragment,
    MemoryInstance,
    Module,
    Shape,
    Signal,
    Value,
)


class Inside:
    """A component, elaborated so that its registers can be accessed by their names in the netlist.

    Induction begins in an arbitrary state, so a harness must restrict the states.
    ``module`` takes the component's place as a submodule; ``parts`` are the component's submodules,
    components and memories.
    """

    def __init__(self, component: Any, platform: Any) -> None:
        self.module = Fragment.get(component, platform)
        self.component = (self.module.origins or (component,))[0]
        self.parts = {name: Inside(part, platform) for part, name, _ in self.module.subfragments}
        ports = {id(port) for inside in (self, *self.parts.values()) for port in inside._ports()}
        # Amaranth has no public function for the signals of a statement.
        self._signals = {
            id(signal): signal
            for statements in self.module.statements.values()
            for signal in (*statements._lhs_signals(), *statements._rhs_signals())
            if id(signal) not in ports
        }

    def _ports(self) -> list[Value]:
        if not hasattr(self.component, "signature"):
            return []
        ports = self.component.signature.flatten(self.component)
        return [Value.cast(port) for _, _, port in ports]

    def __getitem__(self, name: str) -> Signal:
        """The only signal with a name, other than a port."""
        matches = [signal for signal in self._signals.values() if signal.name == name]
        if len(matches) != 1:
            component = type(self.component).__name__
            raise KeyError(f"{component} must have one signal {name}, not {len(matches)}")
        return matches[0]

    def word(self, name: str, address: Any) -> Signal:
        """The word at an address of the memory ``name``, read by an additional port."""
        memory, instance = self.parts[name].component, self.parts[name].module
        assert isinstance(instance, MemoryInstance)
        word = Signal(Shape.cast(memory.shape), name=f"{name}_word")
        bits = (memory.depth - 1).bit_length()
        full_address = Cat(address, Const(0, bits))[:bits]
        instance.read_port(
            domain="comb", addr=full_address, data=word, en=Const(1), transparent_for=()
        )
        return word


T = TypeVar("T")


class Harness(Elaboratable, Generic[T]):
    """A component with the inputs, assumptions and claims of a proof."""

    #: The component's registers, for claims that relate them to those of a model.
    inside: Inside

    def __init__(self, dut: T) -> None:
        self.dut = dut

    def elaborate(self, platform: Any) -> Module:
        """The component with its surroundings."""
        m = Module()
        self.inside = Inside(self.dut, platform)
        m.submodules.dut = self.inside.module
        self.surround(m, self.dut)
        return m

    def surround(self, m: Module, dut: T) -> None:
        """Add inputs, assumptions and claims to ``m``."""
        raise NotImplementedError


def unknown(m: Module, shape: Any, name: str) -> Signal:
    """A signal that the solver chooses anew in every cycle."""
    signal = Signal(shape, name=name)
    m.d.comb += signal.eq(AnySeq(signal.shape()))
    return signal


def fixed(m: Module, shape: Any, name: str) -> Signal:
    """A signal that the solver chooses once: the same value in all cycles."""
    signal = Signal(shape, name=name)
    m.d.comb += signal.eq(AnyConst(signal.shape()))
    return signal


def drive(m: Module, component: Any, *names: str) -> tuple[Signal, ...]:
    """Connect an `unknown` signal to each named input, and return the signals."""
    signals = []
    for name in names:
        port = Value.cast(getattr(component, name))
        signals.append(unknown(m, port.shape(), name))
        m.d.comb += port.eq(signals[-1])
    return tuple(signals)


def before(m: Module, value: Any, name: str) -> Signal:
    """The value of the cycle before; after a reset 0."""
    signal = Signal(value.shape(), name=name)
    m.d.sync += signal.eq(value)
    return signal


def reached(m: Module, condition: Any, name: str) -> Cover:
    """A ``Cover`` that stays reached until a reset, once the condition has been true."""
    latched = Signal(name=name)
    with m.If(condition):
        m.d.sync += latched.eq(1)
    return Cover(latched)


class Stream:
    """One end of a stream: its handshake signals, and its payload, the low parts first."""

    def __init__(self, valid: Any, ready: Any, *payload: Any, name: str) -> None:
        self.valid = valid
        self.ready = ready
        self.payload = Cat(*(Value.cast(part) for part in payload))
        self.name = name

    @property
    def transfer(self) -> Value:
        """1 in a cycle in which a word is transferred."""
        return self.valid & self.ready

    def source(self, m: Module, payload: Value | None = None) -> None:
        """Offer words at any pace; an offered word stays until it is taken."""
        valid = unknown(m, 1, f"{self.name}_valid")
        if payload is None:
            payload = unknown(m, len(self.payload), f"{self.name}_payload")
        m.d.comb += [self.valid.eq(valid), self.payload.eq(payload)]
        m.d.comb += Assume(self._held(m, valid, payload))

    def sink(self, m: Module) -> None:
        """Take words at any pace, and claim that an offered word stays until it is taken."""
        m.d.comb += self.ready.eq(unknown(m, 1, f"{self.name}_ready"))
        m.d.comb += Assert(self._held(m, self.valid, self.payload))

    def _held(self, m: Module, valid: Any, payload: Any) -> Value:
        waited = before(m, valid & ~self.ready, f"{self.name}_waited")
        same = payload == before(m, payload, f"{self.name}_before")
        held: Value = ~waited | (valid & same)
        return held


class StreamHarness(Harness[T]):
    """Any source, any sink: the words of a script come out as expected, once, in order, none lost.

    At most two cycles pass in which source and sink are willing and no word is transferred.
    """

    def ends(self, dut: T) -> tuple[Stream, Stream]:
        """Input and output stream."""
        raise NotImplementedError

    def script(self, m: Module) -> tuple[Sequence[Value], Sequence[Value]]:
        """Words of the input, chosen by the solver, and of the output that they shall give."""
        raise NotImplementedError

    def surround(self, m: Module, dut: T) -> None:
        """Play the script, compare the output."""
        source, sink = self.ends(dut)
        inputs, outputs = self.script(m)
        place, number = Signal(range(len(inputs) + 1)), Signal(range(len(outputs) + 2))
        source.source(m, Array([*inputs, inputs[-1]])[place])
        sink.sink(m)
        all_sent, all_there = place == len(inputs), number == len(outputs)
        m.d.comb += Assume(~source.valid | ~all_sent)
        m.d.sync += [place.eq(place + source.transfer), number.eq(number + sink.transfer)]
        idle = Signal(range(4))
        stuck = (all_sent | source.valid) & sink.ready & ~source.transfer & ~sink.transfer
        m.d.sync += idle.eq(idle + stuck)
        with m.If(source.transfer | sink.transfer | all_there):
            m.d.sync += idle.eq(0)
        expected = Array([*outputs, outputs[-1]])[number]
        m.d.comb += [
            Assert(~sink.valid | (~all_there & (sink.payload == expected))),
            Assert(idle <= 2),
            reached(m, all_there, "all_there"),
            reached(m, sink.valid & ~sink.ready & source.valid & ~source.ready, "both_wait"),
        ]
