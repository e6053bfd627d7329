"""Second-order Butterworth low-pass that begins as a mean: the same code on floats and the tracer.

During the first tau seconds the output is the mean of the samples; then the filter goes on from the
steady state of that mean (Laidig and Seel 2023, section 3.2). Its bilinear form is::

    y_n = b (x_n + 2 x_n-1 + x_n-2) - a1 y_n-1 - a2 y_n-2       fc = sqrt(2) / (2 pi tau)
    C = tan(pi fc Ts)    D = C^2 + sqrt(2) C + 1
    b = C^2/D    a1 = 2 (C^2 - 1)/D    a2 = (1 - sqrt(2) C + C^2)/D

At a corner far below the sample rate b is tiny, and rounding in the direct form grows by 1/(4 b).
The states here are the output's recent part z and an integrator v of the remaining difference,
whose range is small and its word fine; the gain at rest is one for any rounding of coefficients::

    y = z + b x      z' = v - (1 + a1) y + 3 b x      v' = v + 4 b (x - y)

Mean and filter are this one form with other weights, so a channel costs 8 slots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from boresight.model import ops
from boresight.model.words.rounded import PRECISE

#: Room for rounding in the declared ranges.
_MARGIN = 1.001


def gain_of(tau_s: float, step_s: float) -> float:
    """Gain of a first-order low-pass of the time constant tau, 1 - exp(-Ts/tau)."""
    return float(-PRECISE.expm1(-PRECISE.mpf(step_s) / tau_s))


@dataclass(frozen=True)
class Weights:
    """Weights of one sample: y = (z, x), z' = (v, y, x), v' = (v, x, y)."""

    output: tuple[Any, Any]
    recent: tuple[Any, Any, Any]
    missing: tuple[Any, Any, Any]


@dataclass(frozen=True)
class LowPass:
    """The filter of one time constant at one sample rate, both in seconds.

    If tau is below half a step, the output is the input.
    """

    tau_s: float
    step_s: float

    @cached_property
    def coefficients(self) -> tuple[float, float, float]:
        """b, a1, a2."""
        if self.tau_s < 0.5 * self.step_s:
            return 1.0, 0.0, 0.0
        c = float(PRECISE.tan(math.sqrt(0.5) * self.step_s / self.tau_s))
        d = c * c + math.sqrt(2.0) * c + 1.0
        return c * c / d, 2.0 * (c * c - 1.0) / d, (1.0 - math.sqrt(2.0) * c + c * c) / d

    @cached_property
    def mean_samples(self) -> int:
        """Number of first samples whose mean is the output: the least n with n Ts >= tau."""
        n = max(1, math.floor(self.tau_s / self.step_s))
        while n > 1 and (n - 1) * self.step_s >= self.tau_s:
            n -= 1
        while n * self.step_s < self.tau_s:
            n += 1
        return n

    @cached_property
    def largest(self) -> tuple[float, float, float]:
        """Bounds of y, z, v for samples (or vectors of them) of at most unit length.

        Sums of the absolute impulse responses, also for a start from any steady state.
        """
        b, a1, a2 = self.coefficients
        if b == 1.0:
            return 1.0, 1.0, 1.0
        z = v = 0.0
        sums = [0.0, 0.0, 0.0]
        for n in range(20 * self.mean_samples + 40):
            x = float(n == 0)
            y = z + b * x
            z, v = v - (1.0 + a1) * y + 3.0 * b * x, v + 4.0 * b * (x - y)
            sums = [s + abs(c) for s, c in zip(sums, (y, z, v), strict=True)]
        return sums[0] * _MARGIN, sums[1] * _MARGIN, max(sums[2], 1.0 - a2) * _MARGIN

    def weights(self, mean: Any, inverse: Any) -> Weights:
        """Weights of the n-th sample: ``inverse`` is 1/n in (0, 1].

        ``mean``: condition that it is one of the first ``mean_samples``.
        """
        b, a1, a2 = self.coefficients
        through = b == 1.0
        back = 0.0 if through else 1.0 / (1.0 - b)
        newest = ops.bounded(ops.where(mean, inverse, b), 0.0, 1.0, "share of the mean")
        older = ops.bounded(back - back * newest, 0.0, max(back, 1.0), "the rest of it")
        b = 0.0 if through else b
        # Of both weights of v: with a common binary point 4 b is one word.
        bound = max(1.0 - a2, 4.0 * b)
        stay = ops.where(mean, 0.0, 1.0)
        of_y = ops.where(mean, 1.0 - b, 0.0 if through else -1.0 - a1)
        of_x = ops.bounded(ops.where(mean, 0.0, 3.0 * b), 0.0, max(1.0, 3.0 * b), "no finer")
        into = ops.bounded(ops.where(mean, 0.0, 4.0 * b), -bound, bound, "no finer")
        out = ops.bounded(ops.where(mean, 1.0 - a2, -4.0 * b), -bound, bound, "the same")
        return Weights((older, newest), (stay, of_y, of_x), (stay, into, out))


def filtered(
    weights: Weights,
    low_pass: LowPass,
    states: Sequence[tuple[Any, Any]],
    samples: Sequence[Any],
    largest: float,
    hold: Any = None,
) -> tuple[list[Any], list[tuple[Any, Any]]]:
    """Outputs and next states (z, v) of some channels, whose samples are at most ``largest``.

    ``hold``: condition that there is no sample; the states stay, the outputs have no meaning.
    """
    bounds = [c * largest for c in low_pass.largest]
    (g, h), (a, b, c), (d, e, f) = weights.output, weights.recent, weights.missing
    out, after = [], []
    for (z0, v0), x in zip(states, samples, strict=True):
        y = ops.bounded(g * z0 + h * x, -bounds[0], bounds[0], "low-pass")
        z, v = a * v0 + b * y + c * x, d * v0 + e * x + f * y
        if hold is not None:
            z, v = ops.where(hold, z0, z), ops.where(hold, v0, v)
        z = ops.bounded(z, -bounds[1], bounds[1], "low-pass")
        after.append((z, ops.bounded(v, -bounds[2], bounds[2], "low-pass")))
        out.append(y)
    return out, after
