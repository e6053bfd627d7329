"""What an estimator is: declared inputs, parameters, states, and one ``step``.

``step`` is written once with `model.ops`. `Estimator.run_float` runs it on float64 arrays (the
reference); `Estimator.compile` runs it once on tracing scalars and gives the `Program`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError, closest
from boresight.model.fixed import Arithmetic
from boresight.model.graph import Graph, Node
from boresight.model.lower import lower
from boresight.model.program import Kind, Program

__all__ = [
    "Estimator",
    "FloatRun",
    "Input",
    "Output",
    "Param",
    "State",
    "input_words",
    "param_words",
    "with_params",
]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Input:
    """One word of every input record. ``low``/``high``: full scale, in ``unit``."""

    name: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Param:
    """A register that may be written while the estimator runs.

    ``low``/``high`` are its legal range; ``meaning`` says what small and large values do.
    """

    name: str
    default: float
    low: float
    high: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class State:
    """A value carried from sample to sample, with its range and start value.

    Unit ``ht`` marks half turns (binary angle, wrapped).
    """

    name: str
    low: float
    high: float
    unit: str
    initial: float = 0.0


@dataclass(frozen=True)
class Output:
    """One word of every output record."""

    name: str
    unit: str


@dataclass(frozen=True)
class FloatRun:
    """Result of a float run: ``outputs[name]`` has shape (steps, runs)."""

    outputs: dict[str, FloatArray]


class Estimator:
    """Base class of every estimator.

    Class attributes describe the interface; `step` the mathematics. ``urgent`` is the number of
    leading outputs that make up the attitude: the latency that counts ends with them.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    inputs: ClassVar[tuple[Input, ...]]
    params: ClassVar[tuple[Param, ...]]
    states: ClassVar[tuple[State, ...]]
    outputs: ClassVar[tuple[Output, ...]]
    urgent: ClassVar[int]

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update: state ``x``, inputs ``u``, parameters ``p`` (attributes by name).

        Returns the next states and the outputs, by name.
        """
        raise NotImplementedError

    # -- parameters -----------------------------------------------------------------------------

    def param_values(self, given: Mapping[str, float] | None = None) -> dict[str, float]:
        """Defaults with ``given`` on top.

        Raises
        ------
        InputError
            Unknown name, or a value outside the legal range.
        """
        values = {p.name: p.default for p in self.params}
        legal = {p.name: p for p in self.params}
        for name, value in (given or {}).items():
            if name not in legal:
                raise InputError.at(
                    f"parameter {name}",
                    wanted=f"one of {', '.join(closest(name, legal))}",
                    found=repr(name),
                    fix=f"boresight list shows all of {self.name}",
                )
            p = legal[name]
            if not p.low <= value <= p.high:  # NaN fails too
                raise InputError.at(
                    f"parameter {name}",
                    wanted=f"{p.low:g} to {p.high:g} {p.unit}",
                    found=f"{value!r}",
                    fix="choose a value inside the range",
                )
            values[name] = float(value)
        return values

    # -- float reference ------------------------------------------------------------------------

    def run_float(
        self,
        inputs: FloatArray,
        *,
        params: Mapping[str, float] | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> FloatRun:
        """Run the float64 reference.

        Parameters
        ----------
        inputs : (steps, n_inputs, runs)
            Inputs in their units; every run is independent.
        """
        steps, n, runs = inputs.shape
        if n != len(self.inputs):
            raise ValueError(f"inputs must have {len(self.inputs)} columns, not {n}")
        p = SimpleNamespace(**self.param_values(params))
        x = {s.name: np.full(runs, s.initial) for s in self.states}
        out = {o.name: np.empty((steps, runs)) for o in self.outputs}
        names = [i.name for i in self.inputs]
        with np.errstate(all="ignore"):
            for k in range(steps):
                u = SimpleNamespace(**dict(zip(names, inputs[k], strict=True)))
                x, y = self.step(SimpleNamespace(**x), u, p)
                for name, value in y.items():
                    out[name][k] = value
                if progress is not None:
                    progress(k)
        return FloatRun(out)

    # -- program --------------------------------------------------------------------------------

    def compile(self, *, word: int = 32) -> Program:
        """Trace `step` and lower it to a fixed-point `Program` of ``word`` bits.

        Raises
        ------
        InputError
            Width outside 18 to 32, or a value that fixed point cannot hold (named).
        """
        if not 18 <= word <= 32:
            raise InputError.at(
                "word",
                wanted="18 to 32 bits",
                found=str(word),
                fix="choose a width inside the range",
            )
        g = Graph(self.name)
        u = [g.leaf("input", i.name, i.low, i.high, i.unit) for i in self.inputs]
        p = [g.leaf("param", i.name, i.low, i.high, i.unit) for i in self.params]
        x = [g.leaf("state", i.name, i.low, i.high, i.unit) for i in self.states]

        def by_name(nodes: Sequence[Node]) -> SimpleNamespace:
            return SimpleNamespace(**{n.label: n for n in nodes})

        after, out = self.step(by_name(x), by_name(u), by_name(p))
        if set(out) != {o.name for o in self.outputs}:
            raise ValueError(
                f"step of {self.name} must return the declared outputs, not {sorted(out)}"
            )
        if set(after) != {s.name for s in self.states}:
            raise ValueError(
                f"step of {self.name} must return the declared states, not {sorted(after)}"
            )
        return lower(
            self.name,
            arithmetic=Arithmetic(word=word),
            inputs=u,
            params=[(n, i.default) for n, i in zip(p, self.params, strict=True)],
            states=[
                (n, s.initial, g.lift(after[s.name])) for n, s in zip(x, self.states, strict=True)
            ],
            outputs={o.name: g.lift(out[o.name]) for o in self.outputs},
        )


def input_words(program: Program, inputs: FloatArray) -> npt.NDArray[np.int64]:
    """Quantise real inputs (..., n_inputs, runs) to the program's input words (saturating)."""
    words = np.empty(inputs.shape, dtype=np.int64)
    for k, number in enumerate(program.inputs):
        words[..., k, :] = program.format(number).quantise(inputs[..., k, :])
    return words


def param_words(program: Program, values: Mapping[str, float]) -> dict[int, int]:
    """Words of the parameters, by value number."""
    return {
        n: int(program.format(n).quantise(values[program.values[n].name]))
        for n in program.of_kind(Kind.PARAM)
    }


def with_params(
    program: Program, estimator: Estimator, params: Mapping[str, float] | None
) -> Program:
    """The program whose parameter registers start with these values."""
    words = param_words(program, estimator.param_values(params))
    values = list(program.values)
    for number, word in words.items():
        values[number] = replace(values[number], initial=word)
    return replace(program, values=tuple(values))
