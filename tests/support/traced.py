"""A function traced: run in fixed point and in float."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Program

FloatArray = npt.NDArray[np.float64]


class Traced:
    """A function of inputs ``x0, x1, ...`` with the given ranges, traced and compiled."""

    def __init__(
        self,
        function: Callable[..., Any],
        ranges: Sequence[tuple[float, float]],
        word: int = 32,
        unit: str = "",
    ) -> None:
        self.function = function
        self.graph = Tracer("test")
        self.leaves = [
            self.graph.leaf("input", f"x{k}", low, high, unit)
            for k, (low, high) in enumerate(ranges)
        ]
        self.nodes = [self.graph.lift(n) for n in _tuple(function(*self.leaves))]
        self.trace = Trace(self.graph, self.leaves, {f"y{k}": n for k, n in enumerate(self.nodes)})
        self.program: Program = lower(self.trace, Arithmetic(word=word))[0]

    def formats(self) -> list[Any]:
        """Formats of the outputs."""
        return [self.program.format(n) for n in self.program.outputs]

    def run(self, *arrays: Any) -> tuple[list[FloatArray], list[FloatArray], npt.NDArray[np.bool_]]:
        """Results in fixed point, in float (of the same quantised inputs), and saturation."""
        words = np.stack(
            [
                self.program.format(n).quantise(a)
                for n, a in zip(self.program.inputs, arrays, strict=True)
            ]
        )
        exact = [
            self.program.format(n).real(w) for n, w in zip(self.program.inputs, words, strict=True)
        ]
        out, saturated = Interpreter(self.program, words.shape[1]).update(words)
        fixed = [fmt.real(w) for fmt, w in zip(self.formats(), out, strict=True)]
        floats = [
            np.broadcast_to(np.asarray(y, dtype=np.float64), words.shape[1:])
            for y in _tuple(self.function(*exact))
        ]
        return fixed, floats, saturated

    def op_values(self) -> list[int]:
        """Numbers of the values that operations compute."""
        return self.program.of_kind(Kind.OP)


def _tuple(x: Any) -> tuple[Any, ...]:
    return x if isinstance(x, tuple) else (x,)
