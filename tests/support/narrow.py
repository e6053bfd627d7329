"""Random estimators whose intervals are far beyond what they declare."""

from __future__ import annotations

import random
from typing import Any

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State


class Narrow(Estimator):
    """One to three states in narrow ranges, corrected by products of gains in wide ones."""

    def __init__(self, seed: int) -> None:
        rng = random.Random(seed)
        names = "abc"[: rng.randint(1, 3)]
        self.name = f"narrow_{seed}"
        self.inputs = tuple(
            Input(f"u{n}", -size, size) for n in names for size in (rng.choice((1.0, 1.0, 30.0)),)
        )
        self.params = tuple(
            Param(f"g{k}", rng.choice((0.5, 0.8, -0.9, 1.5)), -size, size)
            for k in range(rng.randint(1, 6))
            for size in (rng.choice((2.0, 200.0, 1e4)),)
        )
        self.states = tuple(
            State(f"x{n}", -size, size) for n in names for size in (rng.choice((0.5, 2.0, 100.0)),)
        )
        self.outputs = tuple(
            Output(f"y{n}", tolerance=10.0 ** rng.uniform(-4.0, -1.0)) for n in names
        )
        self.seed = rng.random()

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """The same choices at each call."""
        rng = random.Random(self.seed)
        after: dict[str, Any] = {}
        out: dict[str, Any] = {}
        values = [*vars(x).values(), *vars(u).values()]
        gains = [*vars(p).values()]
        for n in (i.name[1:] for i in self.inputs):
            state, measured = getattr(x, f"x{n}"), getattr(u, f"u{n}")
            d = measured - rng.choice((state, rng.choice(values)))
            for _ in range(rng.randint(0, 6)):
                d = d * rng.choice(gains)
            if rng.random() < 0.3:
                d = d * rng.choice((0.01, 0.25, 3.0)) + rng.choice(values)
            kind = rng.randrange(6)
            if kind == 0:
                d = ops.clip(d, -1.0, 1.0)
            elif kind == 1:
                d = ops.where(measured < state, d, rng.choice(values))
            elif kind == 2:
                d = ops.saturated(d, 0.5)
            after[f"x{n}"] = rng.choice((0.5, 0.9, 1.0)) * state + d
            if rng.random() < 0.3:
                limit = next(s.high for s in self.states if s.name == f"x{n}")
                after[f"x{n}"] = ops.clip(after[f"x{n}"], -limit, limit)
            made = after[f"x{n}"]
            out[f"y{n}"] = rng.choice(
                (made, made, state, d, made * rng.choice(gains), made * measured, 0.5 * made - d)
            )
            values.append(made)
        return after, out
