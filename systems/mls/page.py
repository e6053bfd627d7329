"""The page of the landing-system experiment: targets, pulses, the table's angles, beams, cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from boresight import Target
from boresight.sim.experiments.page import render as page
from boresight.sim.experiments.seeds import Runs
from boresight.sim.pages import Section
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.systems.mls.deck import RATE_HZ
from boresight.systems.mls.patterns import Trial
from boresight.systems.mls.runs import AXES, AZIMUTHS, ENCODER_DEG, GLIDE_DEG, SETTLED
from boresight.systems.mls.world import SCANS

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
    "and 60 deg get over time, a pulse while the beam goes to 62 deg and one while it comes back "
    "(bars), with a pause of 0.6 ms between. "
)
_TURN = (
    "Where the scan turns, 60 deg, X, b = 0.5: with the pause that ICAO Annex 10 has both pulses "
    "stay apart. If the beam turns at once, those of 16 elements are one, as in the paper's "
    "Figure 3f; those of 64 overlap (table: merged, the share that never falls by 3 dB in between)."
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
    "Azimuth antenna (above) and elevation antenna (below), receivers at azimuths of -60, 0 and 60 "
    "deg, 3 deg high (bars), the ship turned by up to 10 deg about each axis: pulses with phases "
    "of a level array, and with phases turned by the filter's attitude, here of beams 3 deg to "
    "each side, at 60 deg past the end of the scan. The ship turns as "
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
    pulses.append((_TURN, _turn(patterns)))
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


_NAMES = {
    **{"closed": "gain, closed form", "wrong": "wrong peaks", "encoder_deg": "from encoder_deg"},
    **{"max_deg": "largest_deg", "worst_deg": "worst axis_deg", "norm": "norm of q"},
    **{"fixed_float_deg": "fixed less float, most_deg", "saturated": "saturated words"},
    "fixed_float_rms_deg": "fixed less float_deg",
}


def _trial(name: str) -> str:
    """``x_05_m60_at_30`` in words."""
    axis, b, azimuth, *elevation = name.replace("at_", "").split("_")
    at = "".join(f", elevation {e}" for e in elevation)
    return f"{axis.upper()}, 0.{b[1:]}, {azimuth.replace('m', MINUS)} deg{at}"


def _words(name: str) -> str:
    """The name of a figure in words, its unit last."""
    name = _NAMES.get(name, name).replace("uncompensated_", "level array, ")
    words = name.replace("m60", f"{MINUS}60").replace("sidelobe", "side lobe").split("_")
    units = {"deg": "deg", "ms": "ms", "db": "dB"}
    if name in ("width", "sd"):
        words.append("deg")
    last = units.get(words[-1])
    return " ".join(words[:-1]) + f", {last}" if last else " ".join(words)


def _cases(
    meanings: Mapping[str, str], figures: Mapping[str, Mapping[str, float]]
) -> Iterator[Section]:
    """Figures of the filter, and of the beams where they are looked at."""
    keys = dict.fromkeys(key for f in figures.values() for key in f)
    beams = {f"Beams, {a}": [k for k in keys if f"{a}_" in k] for a in SCANS}
    filter = [key for key in keys if key not in sum(beams.values(), [])]
    for title, some in {"Filter, root mean square": filter, **beams}.items():
        rows: list[list[str | float]] = [
            [meanings[n], *(f.get(k, math.nan) for k in some)]
            for n, f in figures.items()
            if some[0] in f
        ]
        yield Section(title=title, columns=("case", *map(_words, some)), rows=rows)


def _degrees(angle: float) -> str:
    return f"{angle:.0f} deg".replace("-", MINUS)


def _pulses(patterns: Mapping[str, Trial], axis: str) -> str:
    """Figures 3 to 5: what receivers at three azimuths get over time."""
    scan = SCANS["azimuth"]
    with settings():
        figure, grid = figure_and_axes(3.4, 2, 3, sharex=True, sharey=True)
        for row, b in zip(grid, (1, 5), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                time, amplitude = scan.waveform(*patterns[f"{axis}_0{b}_{key}"].shown)
                for at in scan.times(azimuth):
                    axes.axvline(1e3 * at, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                axes.plot(1e3 * time, amplitude, color=COLOUR["heading"], linewidth=0.8)
                axes.set_title(f"{_degrees(azimuth)}, b = 0.{b}", fontsize=9)
                axes.set_ylim(0.0, 1.05)
        for axes in grid[1]:
            axes.set_xlabel("time, ms")
        return svg(figure, f"pulses-{axis}")


def _turn(patterns: Mapping[int, Mapping[str, Trial]]) -> str:
    """The right end of Figure 3f, with the pause between to and fro and without."""
    with settings():
        figure, row = figure_and_axes(2.2, 1, 2, sharey=True)
        for axes, (elements, trials) in zip(row, patterns.items(), strict=True):
            for pause, name in ((SCANS["azimuth"].pause, "grey"), (0.0, "heading")):
                scan = replace(SCANS["azimuth"], pause=pause)
                time, amplitude = scan.waveform(*trials["x_05_60"].shown)
                middle = sum(scan.times(0.0)) / 2.0
                label = f"pause of {1e3 * pause:g} ms" if pause else "no pause"
                axes.plot(1e3 * (time - middle), amplitude, color=COLOUR[name], label=label)
            axes.set(xlabel=f"time from the turn, ms ({elements} elements)", xlim=(-0.95, 0.95))
        row[0].set_ylabel("amplitude")
        legend(row[0], 2)
        return svg(figure, "turn")


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


def _beams(runs: Runs) -> str:
    """Figure 7: pulses of both antennas with and without compensation."""
    with settings():
        figure, grid = figure_and_axes(4.4, len(SCANS), 3, sharey=True)
        for row, (antenna, scan) in zip(grid, SCANS.items(), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                middle = azimuth if antenna == "azimuth" else GLIDE_DEG
                axes.axvline(middle, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                pulses = runs.shown["pulses"][antenna, key]
                for (angles, amplitude), name in zip(pulses, ("grey", "heading"), strict=True):
                    label = "level array" if name == "grey" else "compensated"
                    axes.plot(angles, amplitude, color=COLOUR[name], label=label)
                low, high = max(middle - 18.0, scan.low - 2.0), min(middle + 18.0, scan.high + 2.0)
                label = f"{antenna}, deg (receiver at {_degrees(azimuth)})"
                axes.set(xlabel=label, xlim=(low, high))
        legend(grid[0][0], 2)
        return svg(figure, "beams")
