"""The page of the landing-system experiment: targets, pulses, the table's angles, beams, cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.mls.flights import AXES, ENCODER_DEG, SETTLED, Beams, Case, Flight
from boresight.sim.experiments.mls.patterns import AZIMUTHS, Trial
from boresight.sim.pages import page
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.worlds.mls_array import SCAN_DEG
from boresight.sim.worlds.mls_deck import RATE_HZ

__all__ = ["render"]


def render(
    cases: Mapping[str, Case],
    found: Mapping[str, Mapping[str, float]],
    shown: Mapping[str, Flight],
    beams: Mapping[str, Beams],
    patterns: Mapping[int, Mapping[str, Trial]],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    return page(
        "boresight.sim.experiments.mls",
        "page.html",
        targets=targets,
        pulses=[(axis, _pulses(patterns[64], axis)) for axis in "xyz"],
        table=_table(shown["corrected"], shown["lag_5ms"]),
        beams=_beams(beams),
        patterns={n: {name: t.figures() for name, t in of.items()} for n, of in patterns.items()},
        keys=list(dict.fromkeys(key for f in found.values() for key in f)),
        cases=cases,
        found=found,
    )


def _pulses(patterns: Mapping[str, Trial], axis: str) -> str:
    """Figures 3 to 5: what receivers at three azimuths get of a scan."""
    with settings():
        figure, grid = figure_and_axes(3.4, 2, 3, sharex=True, sharey=True)
        for row, b in zip(grid, (1, 5), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                amplitude = patterns[f"{axis}_0{b}_{key}"].shown
                scan = np.linspace(-SCAN_DEG, SCAN_DEG, len(amplitude))
                axes.axvline(azimuth, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                axes.plot(scan[::2], amplitude[::2], color=COLOUR["heading"], linewidth=0.8)
                axes.set_title(f"{azimuth:.0f} deg, b = 0.{b}", fontsize=9)
                axes.set_ylim(0.0, 1.05)
        for axes in grid[1]:
            axes.set_xlabel("scan, deg")
        return svg(figure, f"pulses-{axis}")


def _table(good: Flight, late: Flight) -> str:
    """Figure 6: the encoder and the filter, and the error."""
    truth = np.degrees(good.decks[0].euler)
    encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
    some = slice(SETTLED // 10, None, 8)
    t = (np.arange(len(truth)) / RATE_HZ)[some]
    with settings():
        figure, (upper, lower) = figure_and_axes(4.4, 2, sharex=True)
        for k, axis in enumerate(AXES):
            colour = {"color": COLOUR[axis]}
            upper.plot(t, encoder[some, k], color=COLOUR["grey"], linewidth=2.4, alpha=0.6)
            upper.plot(t, (truth[:, k] + good.error[:, 0, k])[some], label=axis, **colour)
            lower.plot(t, good.error[some, 0, k], **colour)
            lower.plot(t, late.error[some, 0, k], linewidth=0.5, **colour)
        upper.set_ylabel("angle, deg (grey: encoder)")
        lower.set(xlabel="time, s", ylabel="error, deg", ylim=(-2.0, 2.0))
        legend(upper, 3)
        return svg(figure, "table")


def _beams(of: Mapping[str, Beams]) -> str:
    """Figure 7: pulses with and without compensation."""
    with settings():
        figure, row = figure_and_axes(2.4, 1, 3, sharey=True)
        for axes, (key, what) in zip(row, of.items(), strict=True):
            azimuth = AZIMUTHS[key]
            axes.axvline(azimuth, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
            for (scan, amplitude), name in zip(what.shown, ("grey", "heading"), strict=True):
                label = "level array" if name == "grey" else "compensated"
                axes.plot(scan, amplitude, color=COLOUR[name], label=label)
            axes.set(xlabel="scan, deg", xlim=(azimuth - 20.0, azimuth + 20.0))
        row[0].set_ylabel("amplitude")
        legend(row[0], 2)
        return svg(figure, "beams")
