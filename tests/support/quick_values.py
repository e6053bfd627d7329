"""Amaranth's simulator with shorter ways to the value of a signal and to the next clock edge.

A bench spends a third of its time in ``eval_value``, which tries one class after the other,
`Signal` next to last, and finds its place by a key that is made anew each time. Here signals come
first, by their numbers; everything else goes the way of Amaranth. What waits for an edge is made in
one go.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from amaranth.hdl import Cat, Const, Signal
from amaranth.sim import _async, _pyeval, pysim

_eval_value = _pyeval.eval_value
_collect_trigger = _async.TickTrigger._collect_trigger
_Concat = type(Cat())
_ZERO = _async.SampleTrigger(Const(0))


class _State(pysim._PyEngineState):  # type: ignore[misc]  # no types
    """Places of signals by their numbers, which are unique in a process."""

    def __init__(self) -> None:
        super().__init__()
        self._places: dict[int, int] = {}

    def get_signal(self, signal: Any) -> int:
        place = self._places.get(signal.duid)
        if place is None:
            place = self._places[signal.duid] = super().get_signal(signal)
        return place


def _value(sim: Any, value: Any) -> int:
    """`_pyeval.eval_value`."""
    kind = type(value)
    if kind is Signal:
        number: int = sim.slots[sim.get_signal(value)].curr
    elif kind is Const:
        number = value.value
    elif kind is _Concat:
        number = place = 0
        for part in value.parts:
            number |= (_value(sim, part) & (1 << len(part)) - 1) << place
            place += len(part)
    else:
        number = _eval_value(sim, value)
    return number


def _triggers(tick: Any) -> Any:
    """`_async.TickTrigger._collect_trigger`."""
    domain = tick._domain
    if domain.async_reset and domain.rst is not None:
        return _collect_trigger(tick)
    triggers = (
        _async.EdgeTrigger(domain.clk, int(domain.clk_edge == "pos")),
        _ZERO,
        _ZERO if domain.rst is None else _async.SampleTrigger(domain.rst),
        *map(_async.SampleTrigger, tick._sampled),
    )
    return _async.TriggerCombination(tick._engine, tick._process, triggers=triggers)


@contextmanager
def quick_values() -> Iterator[None]:
    """The shorter ways, in the block."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pysim, "_PyEngineState", _State)
        patch.setattr(_async.TickTrigger, "_collect_trigger", _triggers)
        for module in (pysim, _pyeval):
            patch.setattr(module, "eval_value", _value)
        yield
