"""Kalman filters drawn at random, and inputs that they can follow."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight import Input, Output, Param, ops
from boresight.kalman import Attitude, Kalman, Measurement, State

#: What couples one state to others, of the magnitudes that a step has; no kink depends on them,
#: where a difference is no derivative.
_COUPLINGS = (
    lambda a, b, on: 0.05 * a,
    lambda a, b, on: 0.02 * a * b,
    lambda a, b, on: 0.05 * ops.sincos_ht(0.25 * a)[0],
    lambda a, b, on: 0.03 * ops.sincos_ht(0.2 * b)[1] * a,
    lambda a, b, on: 0.02 * ops.sqrt(2.0 + a * a),
    lambda a, b, on: 0.02 * a / (3.0 + b * b),
    lambda a, b, on: 0.02 * ops.where(on, a, 2.0 * b),
    lambda a, b, on: 0.02 * ops.tanh(a) * b,
)


class Drawn(Kalman):
    """States of which some have an attitude beside them, coupled at random and stable.

    Some are only considered; some measurements are taken in turn, or every few updates.
    """

    params = (Param("r", 0.1, 0.01, 1.0), Param("q", 1e-3, 1e-4, 1e-2))

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng(seed)
        self.turns = bool(draw.random() < 0.3)
        n = int(draw.integers(2, 10 if self.turns else 13))
        self.names = [f"x{i}" for i in range(n)]
        self.couplings = [
            [
                (draw.choice(len(_COUPLINGS)), int(j), int(draw.integers(n)))
                for j in draw.permutation(n)[: draw.integers(0, 3)]
            ]
            for _ in range(n)
        ]
        self.decay = [float(d) for d in draw.choice([1.0, 0.98, 0.9], n)]
        self.noisy = draw.random(n) < 0.7
        rows = int(draw.integers(1, 7))
        self.rows = [
            (int(draw.integers(n)), draw.random() < 0.5, int(draw.integers(n))) for _ in range(rows)
        ]
        self.flags = draw.random(rows) < 0.3
        self.gates = [5.0 if g else None for g in draw.random(rows) < 0.2]
        self.inputs = (
            *(Input(f"z{k}", -8.0, 8.0) for k in range(rows)),
            Input("new", 0.0, 1.0),
            *(Input(f"g{a}", -2.0, 2.0, "rad/s") for a in "xyz"),
            *(Input(f"a{a}", -2.0, 2.0) for a in "xyz"),
        )
        attitude = (Attitude("q", sd=0.2, sd_max=0.8),) if self.turns else ()
        self.states = (*attitude, *(State(name, -8.0, 8.0, sd=0.5) for name in self.names))
        self.outputs = tuple(Output(name, tolerance=1e-3) for name in self.names)
        super().__init__()

    def f(self, x: Any, u: Any, p: Any) -> Any:
        values = [getattr(x, name) for name in self.names]
        after: dict[str, Any] = {}
        for i, name in enumerate(self.names):
            total = self.decay[i] * values[i]
            for kind, j, k in self.couplings[i]:
                if i not in (j, k):
                    total = total + _COUPLINGS[kind](values[j], values[k], u.new > 0.5)
            after[name] = ops.clip(total, -8.0, 8.0) if i % 3 == 2 else total
        if self.turns:
            after["q"] = [0.01 * (u.g[a] - 0.1 * values[a % len(values)]) for a in range(3)]
            after[self.names[0]] = after[self.names[0]] + 0.02 * x.q.to_nav(u.a)[0]
        return after

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        own = {name: p.q for name, noisy in zip(self.names, self.noisy, strict=True) if noisy}
        return {**own, "q": 1e-5} if self.turns else own

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        results = []
        for k, (i, plain, j) in enumerate(self.rows):
            a, b = (getattr(x, self.names[m]) for m in (i, j))
            h = a if plain else a + 0.3 * ops.sincos_ht(0.3 * b)[0]
            valid = u.new > 0.5 if self.flags[k] else None
            results.append(Measurement(getattr(u, f"z{k}"), h, p.r, valid, self.gates[k]))
        if self.turns:
            z, h = x.q.observed(u.a, (0.0, 0.5, 1.0))
            results.append(Measurement(z[0], h[0], p.r))
            results.append(Measurement(u.z0, x.q.to_body((0.0, 1.0, 1.0))[1], 4.0 * p.r))
        return results


def inputs_of(filter: Drawn, n: int) -> np.ndarray:
    """Measurements that a filter can follow, and turns and vectors around one."""
    draw, t = np.random.default_rng(5), 0.1 * np.arange(n)
    rows = len(filter.rows)
    z = [np.sin(0.3 * t + k) + draw.normal(0.0, 0.3, n) for k in range(rows)]
    turns = [0.5 * np.sin(0.2 * t + k) for k in range(3)]
    seen = np.array([[0.0], [0.5], [1.0]]) + draw.normal(0.0, 0.1, (3, n))
    return np.column_stack([*z, draw.random(n) < 0.5, *turns, *seen])
