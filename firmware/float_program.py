"""One update of an estimator as a list of float operations."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

from boresight.firmware.float_trace import Tape, Value
from boresight.model.estimator import Estimator

__all__ = ["FloatProgram", "trace_float"]


class FloatProgram:
    """What one update computes.

    Attributes
    ----------
    estimator : Estimator
        Its declarations name inputs, parameters, states and outputs.
    values : list of Value
        Those that states or outputs need, in an order in which they can be computed.
    states, outputs : dict of str to Value
        Next states and outputs.
    """

    def __init__(
        self, estimator: Estimator, tape: Tape, states: dict[str, Value], outputs: dict[str, Value]
    ) -> None:
        self.estimator, self.states, self.outputs = estimator, states, outputs
        needed: set[int] = set()
        waiting = [*states.values(), *outputs.values()]
        while waiting:
            value = waiting.pop()
            if value.index not in needed:
                needed.add(value.index)
                waiting += value.args
        self.values = [v for v in tape.values if v.index in needed]

    def counts(self) -> dict[str, int]:
        """How many operations of each kind one update has, leaves not counted."""
        found: dict[str, int] = {}
        for value in self.values:
            if value.args:
                found[value.kind] = found.get(value.kind, 0) + 1
        return dict(sorted(found.items()))


def trace_float(estimator: Estimator) -> FloatProgram:
    """Record one update of an estimator as float operations.

    Raises
    ------
    InputError
        ``step`` raises, as where it uses something that cannot be recorded, or returns other than
        its states and outputs.
    """
    tape = Tape()

    def leaves(kind: str, declared: Sequence[Any]) -> SimpleNamespace:
        return SimpleNamespace(**{d.name: tape.leaf(kind, d.name) for d in declared})

    states, outputs = estimator.checked_step(
        leaves("state", estimator.states),
        leaves("input", estimator.inputs),
        leaves("param", estimator.params),
    )
    return FloatProgram(
        estimator,
        tape,
        {s.name: tape.lift(states[s.name]) for s in estimator.states},
        {o.name: tape.lift(outputs[o.name]) for o in estimator.outputs},
    )
