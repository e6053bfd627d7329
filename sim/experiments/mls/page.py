"""The page of the landing-system experiment: targets, pulses, the table's angles, beams, cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.mls.flights import AXES, ENCODER_DEG, SETTLED, Beams, Case, Flight
from boresight.sim.experiments.mls.patterns import AZIMUTHS
from boresight.sim.pages import page
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.worlds.mls_array import SCAN_DEG
from boresight.sim.worlds.mls_deck import RATE_HZ

__all__ = ["render"]

#: Columns of the table of patterns, by their figure.
_SHOWN = ("gain", "closed", "peak", "width", "sd", "wrong", "sidelobe_db")


def render(
    cases: Mapping[str, Case],
    found: Mapping[str, Mapping[str, float]],
    shown: Mapping[str, Flight],
    beams: Mapping[str, Mapping[float, Beams]],
    patterns: Mapping[int, Mapping[str, tuple[Any, float]]],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    rows = [
        (n, name, [{"closed": closed, **vars(one)}[key] for key in _SHOWN])
        for n, of in patterns.items()
        for name, (one, closed) in of.items()
    ]
    keys = list(dict.fromkeys(key for f in found.values() for key in f))
    return page(
        "boresight.sim.experiments.mls",
        "page.html",
        targets=targets,
        pulses=[(axis, _pulses(patterns[64], axis)) for axis in "xyz"],
        table=_table(shown["corrected"], shown["lag_5ms"]),
        beams=_beams(beams["rolling"]),
        columns=_SHOWN,
        rows=rows,
        keys=keys,
        cases=cases,
        found=found,
    )


def _pulses(patterns: Mapping[str, tuple[Any, float]], axis: str) -> str:
    """Figures 3 to 5: what receivers at three azimuths get of a scan."""
    with settings():
        figure, grid = figure_and_axes(3.4, 2, 3, sharex=True, sharey=True)
        for row, b in zip(grid, ("01", "05"), strict=True):
            for axes, azimuth, name in zip(row, AZIMUTHS, ("m60", "0", "60"), strict=True):
                amplitude = patterns[f"{axis}_{b}_{name}"][0].shown
                scan = np.linspace(-SCAN_DEG, SCAN_DEG, len(amplitude))
                axes.axvline(azimuth, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                axes.plot(scan[::2], amplitude[::2], color=COLOUR["heading"], linewidth=0.8)
                axes.set_title(f"{azimuth:.0f} deg, b = {b[0]}.{b[1]}", fontsize=9)
                axes.set_ylim(0.0, 1.05)
        for axes in grid[1]:
            axes.set_xlabel("scan, deg")
        grid[0][0].set_ylabel("amplitude")
        grid[1][0].set_ylabel("amplitude")
        return svg(figure, f"pulses-{axis}")


def _table(good: Flight, late: Flight) -> str:
    """Figure 6: the encoder and the filter about a jump of each axis, and the error."""
    truth = np.degrees(good.decks[0].euler)
    encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
    t = np.arange(len(truth)) / RATE_HZ
    with settings():
        figure, (upper, lower) = figure_and_axes(4.4, 2, sharex=True)
        for k, axis in enumerate(AXES):
            upper.plot(t[::10], encoder[::10, k], color=COLOUR["grey"], linewidth=2.2, alpha=0.6)
            told = truth[:, k] + good.error[:, 0, k]
            upper.plot(t[SETTLED // 20 :: 10], told[SETTLED // 20 :: 10], color=COLOUR[axis], label=axis)
            for flight, width in ((good, 1.1), (late, 0.5)):
                error = flight.error[SETTLED // 20 :: 5, 0, k]
                lower.plot(t[SETTLED // 20 :: 5], error, color=COLOUR[axis], linewidth=width)
        upper.set_ylabel("angle, deg (grey: encoder)")
        lower.set(xlabel="time, s", ylabel="error, deg", ylim=(-2.0, 2.0))
        legend(upper, 3)
        return svg(figure, "table")


def _beams(of: Mapping[float, Beams]) -> str:
    """Figure 7: pulses with and without compensation."""
    with settings():
        figure, row = figure_and_axes(2.4, 1, 3, sharey=True)
        for axes, (azimuth, what) in zip(row, of.items(), strict=True):
            axes.axvline(azimuth, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
            for (scan, amplitude), name, colour in zip(
                what.shown, ("level array", "compensated"), ("grey", "heading"), strict=True
            ):
                axes.plot(scan, amplitude, color=COLOUR[colour], label=name)
            axes.set(xlabel="scan, deg", xlim=(azimuth - 20.0, azimuth + 20.0))
        row[0].set_ylabel("amplitude")
        legend(row[0], 2)
        return svg(figure, "beams")
