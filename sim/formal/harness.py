"""Harnesses around a component: words chosen by the solver, past values, covers."""

from __future__ import annotations

from typing import Any, Generic, TypeVar

from amaranth.hdl import Cover, Elaboratable, Module, Signal
from amaranth.hdl import _ast as _amaranth  # the language has no public name for these two yet

from boresight.sim.formal.inside import Inside

__all__ = ["Harness", "after_start", "before", "fixed", "reached", "unknown"]

T = TypeVar("T")


class Harness(Elaboratable, Generic[T]):
    """A component, with the inputs, assumptions and claims of a proof.

    Parameters
    ----------
    dut : T
        Component.
    """

    def __init__(self, dut: T) -> None:
        self.dut = dut

    def elaborate(self, platform: Any) -> Module:
        """The component with its surroundings."""
        m = Module()
        m.submodules.dut = (inside := Inside(self.dut, platform)).module
        self.surround(m, self.dut, inside)
        return m

    def surround(self, m: Module, dut: T, inside: Inside) -> None:
        """Add inputs, assumptions and claims to ``m``; ``inside`` has the registers."""
        raise NotImplementedError


def unknown(m: Module, shape: Any, name: str) -> Signal:
    """A signal that the solver chooses anew in every cycle.

    Parameters
    ----------
    m : Module
        Module of the harness.
    shape : shape
        Width or shape.
    name : str
        Name in counterexamples.
    """
    signal = Signal(shape, name=name)
    m.d.comb += signal.eq(_amaranth.AnySeq(signal.shape()))
    return signal


def fixed(m: Module, shape: Any, name: str) -> Signal:
    """A signal that the solver chooses once: the same value in all cycles."""
    signal = Signal(shape, name=name)
    m.d.comb += signal.eq(_amaranth.AnyConst(signal.shape()))
    return signal


def before(m: Module, value: Any, name: str, *, init: int = 0) -> Signal:
    """The value of the cycle before; after a reset ``init``."""
    signal = Signal(value.shape(), name=name, init=init)
    m.d.sync += signal.eq(value)
    return signal


def after_start(m: Module) -> Signal:
    """1 from the second cycle after a reset on, when `before` is a value of a real cycle."""
    signal = Signal(name="after_start")
    m.d.sync += signal.eq(1)
    return signal


def reached(m: Module, condition: Any, name: str) -> Cover:
    """A ``Cover`` that, once the condition has been true, stays reached (until a reset).

    A proof may then look for it in its last cycles only (``Proof.cover`` as a range), which is
    much faster than looking in all of them.
    """
    latched = Signal(name=name)
    with m.If(condition):
        m.d.sync += latched.eq(1)
    return Cover(latched)
