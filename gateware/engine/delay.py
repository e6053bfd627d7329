"""Registers in a row with a clock enable and without reset."""

from __future__ import annotations

from amaranth.hdl import Module, Signal, Value


def delayed(m: Module, value: Value, *, en: Value, names: list[str]) -> Value:
    """The value of as many enabled cycles before as there are ``names``, those of the registers."""
    for name in names:
        register = Signal(value.shape(), name=name, reset_less=True)
        with m.If(en):
            m.d.sync += register.eq(value)
        value = register
    return value
