"""Reusable parts of filters, written with the ordinary operations (`docs/operations.md`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeAlias

from boresight.model import ops
from boresight.model.declarations import State
from boresight.model.errors import InputError, author_line, require
from boresight.model.words.rounded import binary_exponent, sum_of

#: b0, b1, b2, a1, a2.
Section: TypeAlias = tuple[float, float, float, float, float]

#: Room for rounding in the declared ranges, and in that of a table, as shares of them.
_MARGIN, _SLACK = 1.0001, 2e-8
#: Share of the sum at which an impulse response is cut off, and maximum number of samples.
_END, _MOST = 1e-12, 2_000_000


@dataclass(frozen=True)
class Cascade:
    """Second-order sections in cascade, the same code on floats and the tracer.

    Each is of direct form I, whose states are samples of its input and output::

        y_n = b0 x_n + b1 x_n-1 + b2 x_n-2 - a1 y_n-1 - a2 y_n-2

    One accumulator adds the five products and rounds once. The output of a section is the input of
    the next, so n sections have 2 n + 2 states and 5 n products. The other forms have fewer states,
    but these are rounded and their ranges are not those of a signal.

    Effects of fixed point:

    * **Ranges.** Between sections a signal may be larger than at either end.
      `Cascade.largest_values` bounds it by sums of absolute impulse responses; leave sections in
      scipy's order.
    * **Rounding** is fed back through the poles. `Cascade.rounding` bounds it, in LSB. At a corner
      far below the sample rate it is large, (rate / 2 pi corner)^2, and may be a constant error.
      Decimate first, or use `model.algebra.low_pass`, whose second state has a finer LSB.
    * **Coefficients** are rounded to a word, relative 2^-W of the largest: poles at 1 - e move by
      about 2^-W / e. Narrow words need sections of lower Q.

    Parameters
    ----------
    sections : tuple of (b0, b1, b2, a1, a2)
    largest : float
        Largest magnitude of the input.
    """

    sections: tuple[Section, ...]
    largest: float

    @classmethod
    def of(cls, sos: Iterable[Sequence[float]], largest: float) -> Cascade:
        """From rows b0, b1, b2, a0, a1, a2, as scipy's ``output="sos"``.

        The program's bits depend on every bit of these numbers: for the same program on every
        machine, write down the numbers that scipy computed.

        InputError: a row has not six finite numbers, or a pole is not inside the unit circle.
        """
        where, sections = author_line() or "sections", []
        for row in ([float(c) for c in row] for row in sos):
            valid = len(row) == 6 and all(map(math.isfinite, row)) and row[3] != 0.0
            require(valid, where, "rows b0, b1, b2, a0, a1, a2", row, "as scipy's output='sos'")
            b0, b1, b2, _, a1, a2 = (c / row[3] for c in row)
            stable = abs(a2) < 1.0 and abs(a1) < 1.0 + a2
            require(stable, where, "poles inside the unit circle", (a1, a2), "design it anew")
            sections.append((b0, b1, b2, a1, a2))
        require(bool(sections), where, "a section or more", 0)
        return cls(tuple(sections), float(largest))

    @cached_property
    def largest_values(self) -> tuple[float, ...]:
        """Bounds of the input and of each section's output.

        InputError: the poles are too near the unit circle for a bound.
        """
        sums = (_absolute_sum(self.sections[: k + 1]) for k in range(len(self.sections)))
        return (self.largest, *(_MARGIN * self.largest * total for total in sums))

    @cached_property
    def rounding(self) -> float:
        """Bound of the effect of all roundings on the output, in its LSB.

        Half an LSB of each section, through its own poles and the sections after it.
        """
        total, sizes = 0.0, [binary_exponent(bound) for bound in self.largest_values[1:]]
        for k, section in enumerate(self.sections):
            tail = ((1.0, 0.0, 0.0, *section[3:]), *self.sections[k + 1 :])
            total += math.ldexp(0.5 * _absolute_sum(tail), sizes[k] - sizes[-1])
        return total

    def states(self, name: str, unit: str = "") -> tuple[State, ...]:
        """``NAME0_1``, ``NAME0_2``: earlier inputs; ``NAME1_1``, ...: outputs of section 1."""
        return tuple(
            State(f"{name}{k}_{age}", -bound, bound, unit)
            for k, bound in enumerate(self.largest_values)
            for age in (1, 2)
        )

    def step(self, name: str, x: Any, sample: Any) -> tuple[dict[str, Any], Any]:
        """Next states by name, and the output of the last section.

        Parameters
        ----------
        name : str
            As in `states`.
        x : states
            States, the argument of the estimator's ``step``.
        sample : scalar
        """
        after: dict[str, Any] = {}
        signal, last = sample, len(self.sections)
        old = [[getattr(x, f"{name}{k}_{age}") for age in (1, 2)] for k in range(last + 1)]
        for k, (b0, b1, b2, a1, a2) in enumerate(self.sections):
            after |= {f"{name}{k}_1": signal, f"{name}{k}_2": old[k][0]}
            (x1, x2), (y1, y2) = old[k], old[k + 1]
            out = b0 * signal + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2
            bound = self.largest_values[k + 1]
            signal = ops.bounded(out, -bound, bound, "sum of the absolute impulse response")
        return after | {f"{name}{last}_1": signal, f"{name}{last}_2": old[last][0]}, signal


def _absolute_sum(chain: Sequence[Sequence[float]]) -> float:
    """Sum of the absolute impulse response: additions and products, the same on every machine."""
    total, quiet = 0.0, 0
    memory = [[0.0] * 4 for _ in chain]
    for n in range(_MOST):
        y = float(n == 0)
        for k, (b0, b1, b2, a1, a2) in enumerate(chain):
            x, (x1, x2, y1, y2) = y, memory[k]
            y = b0 * x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2
            memory[k] = [x, x1, y, y1]
        total += abs(y)
        quiet = quiet + 1 if abs(y) <= _END * total else 0
        if quiet > 200 and total > 0.0:
            return total
    wanted = f"an impulse response that dies away within {_MOST:,} samples"
    found = f"poles {[section[3:] for section in chain]}"
    fix = "sample more slowly, or raise the corner"
    raise InputError.at("sections", wanted=wanted, found=found, fix=fix)


@dataclass(frozen=True)
class MovingSum:
    """The sum of the last samples, the same code on floats and the tracer.

    The states hold the samples, and one accumulator adds them: nothing drifts, and the sum is
    rounded once. A running sum (plus the newest, minus the oldest sample) needs the same states, a
    word that holds the whole sum with the LSB of a sample, and never recovers from an upset. A core
    has room for 128 states (`docs/engine.md`): for longer windows, add sums of groups of samples.

    ``length``: samples in the window; ``low``, ``high``: range of a sample. InputError: the window
    has fewer than 2 samples.
    """

    length: int
    low: float
    high: float

    def __post_init__(self) -> None:
        require(self.length >= 2, author_line, "a window of 2 samples or more", self.length)

    def states(self, name: str, unit: str = "") -> tuple[State, ...]:
        """Earlier samples, ``NAME_1`` the newest; initially 0, or the nearest value in range."""
        first = min(max(0.0, self.low), self.high)
        return tuple(
            State(f"{name}_{k}", self.low, self.high, unit, first) for k in range(1, self.length)
        )

    def step(self, name: str, x: Any, sample: Any) -> tuple[dict[str, Any], Any]:
        """Next states by name, and the sum with this sample; see `Cascade.step`."""
        window = [sample, *(getattr(x, f"{name}_{k}") for k in range(1, self.length))]
        return {f"{name}_{k}": window[k - 1] for k in range(1, self.length)}, sum_of(window)


def interpolated(x: Any, points: Sequence[float], values: Sequence[float]) -> Any:
    """Value at ``x`` between points, as `numpy.interp`; constant beyond the ends.

    With points (a_k, y_k) and slopes s_k between them::

        h_k = max(x - a_k, 0)        y = y_0 + sum_k s_k (h_k - h_k+1)

    ``points`` (n,) rise, at least two; ``values`` (n,) are those of the function there. Distances
    and points have the resolution of x or half of it; one accumulator adds all products and rounds
    once. Each point costs 5 slots.

    InputError: the points do not rise, a number is not finite, or the lengths differ.
    """
    a, y = [[float(v) for v in column] for column in (points, values)]
    fix = "give two or more points with their values"
    require(len(a) == len(y) >= 2, author_line, "as many values as points", (len(a), len(y)), fix)
    valid = all(map(math.isfinite, a + y)) and all(b > c for c, b in pairwise(a))
    require(valid, author_line, "finite points that rise", a, "sort them, each once")
    slopes = [(y[k + 1] - y[k]) / (a[k + 1] - a[k]) for k in range(len(a) - 1)]
    ramps = [ops.maximum(x - point, 0.0) for point in a]
    total: Any = y[0]
    for slope, (ramp, next_ramp) in zip(slopes, pairwise(ramps), strict=True):
        total = total + slope * ramp - slope * next_ramp
    low, high = min(y), max(y)
    slack = _SLACK * max(high - low, abs(low), abs(high))
    return ops.bounded(total, low - slack, high + slack, "values of the table")
