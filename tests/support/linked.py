"""Programs of one core that read what others keep: a source, a reader, a reader of both."""

from __future__ import annotations

import functools
from typing import Any

from boresight.gateware.core import Core, build_shared_core
from boresight.model import ops
from boresight.model.declarations import Input, Output, State
from boresight.model.estimator import Estimator
from boresight.model.linking import families, first_word, linked_estimators
from boresight.model.words.interpreter import Interpreter


class Inner(Estimator):
    """A sum that leaks, which is a state, and a product, which is none."""

    inputs = (Input("a", -1.0, 1.0, "m"), Input("b", -1.0, 1.0, "m"))
    states = (State("half", -0.9, 0.9, "m", initial=0.75),)
    outputs = (Output("half", "m"), Output("product", "m^2"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        half = ops.bounded(x.half * 0.4 + u.a * 0.5, -0.9, 0.9, "what it leaks")
        return {"half": half}, {"half": half, "product": u.a * u.b}


class Middle(Estimator):
    """Reads both words of `Inner`, with states of its own."""

    inputs = (
        Input("half", -8.0, 8.0, "m", source="inner.half"),
        Input("c", -1.0, 1.0, "m"),
        Input("product", -1.0, 1.0, "m^2", source="inner.product"),
        Input("d", -1.0, 1.0, "m"),
    )
    states = (State("kept", -4.0, 4.0, "m"), State("other", -4.0, 4.0, "m^2"))
    outputs = (Output("sum", "m"), Output("other", "m^2"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        kept = 0.5 * x.kept + 0.125 * u.half + u.c
        other = 0.5 * x.other + u.product * 0.5 + u.c * u.d
        return {"kept": kept, "other": other}, {"sum": kept + u.d, "other": other}


class Outer(Estimator):
    """Reads `Middle` and `Inner`; the word of the one it limits to its own range."""

    inputs = (
        Input("e", -1.0, 1.0, "m"),
        Input("sum", -1.5, 1.0, "m", source="middle.sum", clamp=True),
        Input("product", -2.0, 2.0, "m^2", source="inner.product"),
        Input("f", -1.0, 1.0, "m"),
    )
    outputs = (Output("all", "m"), Output("sum", "m"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update."""
        return {}, {"all": u.e * u.f + u.sum + u.product, "sum": 1.0 * u.sum}


@functools.cache
def linked_core(config: str = "small") -> Core:
    """A core whose readers stand before what they read."""
    made = linked_estimators([Outer(), Middle(), Inner()])
    return build_shared_core([e.compile() for e in made], config)


class Models:
    """Interpreters of a core's programs that pass words to each other as their links say.

    Programs that share states pass these on.
    """

    def __init__(self, core: Core) -> None:
        self.programs = [part.program for part in core.parts]
        self.interpreters = [Interpreter(p) for p in self.programs]
        self.saturated = False
        self._family = families(self.programs)
        self._states = [model.states for model in self.interpreters]
        self._kept = {
            (p.name, output): first_word(p, output)
            for p in self.programs
            for output in p.output_names
        }

    def record(self, number: int, streamed: list[int]) -> list[int]:
        """All input words of an update whose record brings these."""
        program = self.programs[number]
        words = dict(zip(program.streamed, streamed, strict=True))
        words |= {n: self._kept[k.program, k.output] for n, k in program.linked.items()}
        return [words[n] for n in program.inputs]

    def states(self, number: int) -> list[int]:
        """State words that the next update of a program begins with."""
        words: list[int] = self._states[self._family[number]][:, 0].tolist()
        return words

    def update(self, number: int, streamed: list[int]) -> list[int]:
        """Output words of an update; ``saturated`` is its flag."""
        program = self.programs[number]
        rows = [[word] for word in self.record(number, streamed)]
        model, owner = self.interpreters[number], self._family[number]
        model.states = self._states[owner]
        words, flags = model.update(rows)
        out: list[int] = words[:, 0].tolist()
        self.saturated = bool(flags[0])
        self._states[owner] = model.states
        self._kept |= {(program.name, n): w for n, w in zip(program.output_names, out, strict=True)}
        return out
