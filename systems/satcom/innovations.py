"""Consistency of Q and R: normalised innovations, their square, and whether they are white.

Innovations over the root of their variance S are white, of variance one, where the filter's model
is the truth (Bar-Shalom, Li, Kirubarajan 2001, section 5.4). The mean of nu^2/S of n samples then
lies within 1 +- 1.96 sqrt(2/n), each autocorrelation within +- 1.96/sqrt(n), 19 times of 20.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg


class Innovations(NamedTuple):
    """Statistics of one measurement's innovations in one run."""

    nis: float  #: mean of nu^2/S.
    nis_band: float  #: largest distance of a consistent filter's from one.
    correlation: FloatArray  #: of nu/sqrt(S), (lags,), from lag 1 on.
    band: float  #: largest distance of a consistent filter's from zero.


def innovations(normalised: FloatArray, valid: BoolArray, lags: int = 25) -> Innovations:
    """Of nu/sqrt(S) (n,) where ``valid`` (n,); pairs of which one is not count in no lag."""
    x = np.where(valid, normalised, 0.0)
    count = max(int(valid.sum()), 1)
    power = max(float((x * x).sum()) / count, 1e-300)
    results = []
    for lag in range(1, lags + 1):
        pairs = int((valid[lag:] & valid[:-lag]).sum())
        results.append(float((x[lag:] * x[:-lag]).sum()) / max(pairs, 1) / power)
    return Innovations(
        power, 1.96 * np.sqrt(2.0 / count), np.array(results), 1.96 / np.sqrt(float(count))
    )


def plot_innovations(
    runs: Sequence[Sequence[Innovations]], names: Sequence[str], identity: str
) -> str:
    """SVG of many runs' measurements: squares of each run, correlation over all, with bands."""
    with settings():
        figure, (left, right) = figure_and_axes(2.6, 1, 2)
        for k, (name, default) in enumerate(zip(names, cycle(COLOUR.values()), strict=False)):
            colour = COLOUR.get(name, default)
            results = [run[k] for run in runs]
            positions = k + np.linspace(-0.3, 0.3, len(results))
            left.plot(positions, [result.nis for result in results], ".", color=colour)
            rho = np.mean([result.correlation for result in results], axis=0)
            right.plot(np.arange(1, len(rho) + 1), rho, ".-", color=colour, label=name)
            for sign in (-1.0, 1.0):
                edge = 1.0 + sign * results[0].nis_band
                left.hlines(edge, k - 0.4, k + 0.4, color=colour, linestyle=":")
                right.axhline(sign * results[0].band, color=colour, linestyle=":", linewidth=0.8)
        left.set(ylabel="mean of nu\N{SUPERSCRIPT TWO}/S", ylim=(0.0, max(1.3, left.get_ylim()[1])))
        left.set_xticks(range(len(names)), names)
        right.set(xlabel="lag, samples of the measurement", ylabel="autocorrelation")
        legend(right, len(names))
        return svg(figure, identity)
