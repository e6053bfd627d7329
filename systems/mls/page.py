"""The page of the landing-system experiment: targets, pulses, the table's angles, beams, cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from boresight import Target
from boresight.sim.experiments.page import Section
from boresight.sim.experiments.page import render as page
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.mls.deck import RATE_HZ
from boresight.systems.mls.patterns import Trial
from boresight.systems.mls.runs import AXES, AZIMUTHS, ENCODER_DEG, SETTLED
from boresight.systems.mls.world import SCAN_DEG

__all__ = ["render"]

MINUS = "\N{MINUS SIGN}"

_INTRO = (
    "A landing-system array on a moving deck. Wang Ding et al. (2018) show pulses of a phased "
    "array whose elements are out of place (Figures 3 to 5), a quaternion Kalman filter on a "
    "turntable (6), and pulses after compensation (7); they print no numbers. Here are numbers. "
    "The phases that make every pattern are those of the core's program; the filter is the "
    "integer program too.",
    "Elements are half a wavelength apart, the receiver stands 3 deg high. Gyro 0.3 deg/s of noise "
    "a sample at 1 kHz with the bias that gives the prototype's figures, accelerometer 0.02 g, "
    "field 2 %. What does not hold, or is not asked for, has a note.",
)
_PULSES = (
    "Elements displaced along {} by b d N(0, 1), 64 elements, one draw: what receivers at -60, 0 "
    "and 60 deg (bars) get of a scan. "
)
_AXES = {
    "x": "At b = 0.5 only the ends of the scan are usable, as the paper says; at 0.1 the pulse is "
    "lower, but as wide as before.",
    "y": "In the centre a displacement along the array does not change the path.",
    "z": "Along Z it counts with the sine of the elevation: on a glide path of 3 deg there is "
    "nothing to see, at 30 deg (table) there is.",
}
_TABLE = (
    "Encoder of 1024 lines (0.088 deg) and filter, and the error; thin: gyro 5 ms late. Every "
    "1.5 s an axis jumps by 8 deg in 60 ms. The filter begins with the mean of an eighth of a "
    "second, and forgets its error slowly."
)
_BEAMS = (
    "Pulses at receivers at -60, 0 and 60 deg (bars), the ship turned by up to 10 deg about each "
    "axis: phases of a level array, and phases turned by the filter's attitude. The ship turns as "
    "a whole here; displacements as in (14), of each element by itself, are beyond what any "
    "attitude can take back."
)


def render(
    meanings: Mapping[str, str],
    figures: Mapping[str, Mapping[str, float]],
    flights: Mapping[str, Runs],
    patterns: Mapping[int, Mapping[str, Trial]],
    targets: Sequence[Target],
) -> str:
    """HTML text: no script, nothing outside."""
    pulses = [(_PULSES.format(a.upper()) + _AXES[a], _pulses(patterns[64], a)) for a in "xyz"]
    trials: list[list[str | float]] = [
        [f"{n}, {_trial(name)}", *trial.figures.values()]
        for n, by_name in patterns.items()
        for name, trial in by_name.items()
    ]
    columns = ("elements, axis, b, azimuth", *map(_words, patterns[64]["x_01_0"].figures))
    table, beams = _table(flights["corrected"], flights["lag_5ms"]), _beams(flights["rolling"])
    return page(
        "mls",
        _INTRO,
        targets,
        [
            Section(title="Figures 3 to 5: elements out of place", figures=pulses),
            Section(title="The same in numbers", columns=columns, rows=trials),
            Section(title="Figure 6: the filter on a turntable", figures=[(_TABLE, table)]),
            Section(title="Figure 7: compensation", figures=[(_BEAMS, beams)]),
            *_cases(meanings, figures),
        ],
    )


def _trial(name: str) -> str:
    """``x_05_m60_at_30`` in words."""
    axis, b, azimuth, *elevation = name.replace("at_", "").split("_")
    at = "".join(f", elevation {e}" for e in elevation)
    return f"{axis.upper()}, 0.{b[1:]}, {azimuth.replace('m', MINUS)} deg{at}"


def _words(name: str) -> str:
    """The name of a figure in words, its unit last."""
    name = {"closed": "gain, closed form", "wrong": "wrong peaks"}.get(name, name)
    words = name.replace("m60", f"{MINUS}60").replace("sidelobe", "side lobe").split("_")
    units = {"deg": "deg", "ms": "ms", "db": "dB"}
    if name in ("width", "sd"):
        words.append("deg")
    last = units.get(words[-1])
    return " ".join(words[:-1]) + f", {last}" if last else " ".join(words)


def _cases(
    meanings: Mapping[str, str], figures: Mapping[str, Mapping[str, float]]
) -> Iterator[Section]:
    """Figures of the filter, and of the beam where it is looked at."""
    keys = dict.fromkeys(key for f in figures.values() for key in f)
    beam = [key for key in keys if key.startswith(("beam_", "uncompensated_"))]
    for title, some in (("Cases", [k for k in keys if k not in beam]), ("Beams", beam)):
        rows: list[list[str | float]] = [
            [meanings[n], *(f.get(k, math.nan) for k in some)]
            for n, f in figures.items()
            if some[0] in f
        ]
        yield Section(title=title, columns=("", *map(_words, some)), rows=rows)


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


def _table(nominal: Runs, late: Runs) -> str:
    """Figure 6: the encoder and the filter, and the error."""
    truth, error = nominal.shown["truth"], nominal.shown["error"]
    encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
    samples = slice(SETTLED // 10, None, 8)
    t = (np.arange(len(truth)) / RATE_HZ)[samples]
    with settings():
        figure, (upper, lower) = figure_and_axes(4.4, 2, sharex=True)
        for k, axis in enumerate(AXES):
            colour = {"color": COLOUR[axis]}
            upper.plot(t, encoder[samples, k], color=COLOUR["grey"], linewidth=2.4, alpha=0.6)
            upper.plot(t, (truth + error)[samples, k], label=axis, **colour)
            lower.plot(t, error[samples, k], **colour)
            lower.plot(t, late.shown["error"][samples, k], linewidth=0.5, **colour)
        upper.set_ylabel("angle, deg (grey: encoder)")
        lower.set(xlabel="time, s", ylabel="error, deg", ylim=(-2.0, 2.0))
        legend(upper, 3)
        return svg(figure, "table")


def _near(azimuth: float) -> tuple[float, float]:
    most = SCAN_DEG + 2.0
    return max(azimuth - 20.0, -most), min(azimuth + 20.0, most)


def _beams(runs: Runs) -> str:
    """Figure 7: pulses with and without compensation."""
    with settings():
        figure, row = figure_and_axes(2.4, 1, 3, sharey=True)
        for axes, (key, pulses) in zip(row, runs.shown["pulses"].items(), strict=True):
            azimuth = AZIMUTHS[key]
            axes.axvline(azimuth, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
            for (scan, amplitude), name in zip(pulses, ("grey", "heading"), strict=True):
                label = "level array" if name == "grey" else "compensated"
                axes.plot(scan, amplitude, color=COLOUR[name], label=label)
            axes.set(xlabel="scan, deg", xlim=_near(azimuth))
        row[0].set_ylabel("amplitude")
        legend(row[0], 2)
        return svg(figure, "beams")
