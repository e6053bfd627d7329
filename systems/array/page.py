"""The page of the array experiment: targets, errors over hours, words, cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from boresight import Target
from boresight.sim.experiments.page import numbers
from boresight.sim.experiments.page import render as page
from boresight.sim.experiments.seeds import Runs
from boresight.sim.pages import Section
from boresight.sim.plotting import COLOUR, band, figure_and_axes, legend, settings, svg
from boresight.systems.array.cases import CASES, RATES
from boresight.systems.array.runs import EVERY
from boresight.systems.array.words import FORTY, WORDS
from boresight.systems.array.world import ANGLES, DT

_INTRO = (
    "A radar array rests for 300 s, in which its attitude is found from gyros and accelerometers. "
    "It is erected to a pitch of 66 deg, and turned about the vertical for hours. A mark on the "
    "turntable tells its azimuth once a turn. Wang Wenzhe et al. (2016) print errors after each "
    "hour. Here the integer program of the core runs through every sample, in C.",
    "Sensor errors are the paper's (gyro 0.003 deg/h, 1e-5, 20e-6; accelerometer 20 ug, 1e-4, "
    "20e-6), their signs drawn in every run. As in the paper there is no noise, unless a case says "
    "so. Errors count while it turns.",
)
_OVER = (
    "First run, least and most of each 240th of the time. The heading is worst before the filter "
    "has seen some turns."
)
_WORDS = (
    "The strapdown alone, perfect sensors that count in words of the same length: worst angle "
    "while it turns, root mean square. Carried: remainders in a second word; plain: none. Grey: "
    "what a prototype in words of 40 bits had in eight hours, the specification's reason to ask "
    "for them."
)
_CASES = "Over all runs of each; arcsec unless stated otherwise."
_COLUMNS = {
    **{f"{a} rms, most": (f"{a}_rms", f"{a}_max") for a in ANGLES},
    **{"heading: after the rest, rms": ("heading_rested_rms",)},
    **{"second turn on, rms, most": ("heading_later_rms", "heading_later_max")},
    **{"1 sigma of the hours": tuple(f"{a}_sigma" for a in ANGLES)},
    **{"scale of the up gyro, ppm": ("scale_up_ppm",)},
    **{"indices used, refused": ("used_sum", "refused_sum")},
    **{"less float64, rms, most": ("fixed_float_rms", "fixed_float_max")},
}


def render(flown: Mapping[str, Runs], words: Mapping[str, Runs], targets: Sequence[Target]) -> str:
    """HTML text: no script, nothing outside."""
    rates = [f"{deg_s:g} deg/s" for deg_s in RATES.values()]
    bands = [(rate, _bands(flown, key)) for key, rate in zip(RATES, rates, strict=True)]
    sections = [
        Section(title="Errors over the hours", text=_OVER, figures=bands),
        Section(title="How long words must be", text=_WORDS, figures=[("", _lengths(words))]),
        Section(title="Cases", text=_CASES, columns=("", "runs", *_COLUMNS), rows=_cases(flown)),
    ]
    return page("array", _INTRO, targets, sections)


def _cases(flown: Mapping[str, Runs]) -> list[list[str | float]]:
    rows: list[list[str | float]] = []
    for name, case in CASES.items():
        pooled = flown[name].pooled()
        cells = [
            numbers((pooled[key] for key in keys), ".0f" if keys[0] == "used_sum" else ".3g")
            if _is_known(keys[0], name, flown)
            else ""
            for keys in _COLUMNS.values()
        ]
        rows.append([case.meaning, str(len(flown[name].each)), *cells])
    return rows


def _is_known(figure: str, name: str, flown: Mapping[str, Runs]) -> bool:
    """Whether a case has a figure."""
    if figure.endswith("sigma"):
        return len(flown[name].each[0].hourly) > 1  # one hour has no spread
    return CASES[name].compared or not figure.startswith("fixed")


def _bands(flown: Mapping[str, Runs], key: str) -> str:
    """Errors of the first run with each reading of the index."""
    with settings():
        figure, axes = figure_and_axes(6.0, 3, sharex=True)
        for name, colour in (("none", "grey"), ("literal", "amber"), ("index", "heading")):
            label = CASES[f"{key}_{name}"].meaning.partition(", ")[2]
            style = {"color": COLOUR[colour], "label": label, "alpha": 0.75, "linewidth": 0.8}
            for plot, error in zip(axes, flown[f"{key}_{name}"].each[0].error.T, strict=True):
                band(plot, error, EVERY * DT / 3600.0, 240, **style)
        for axis, plot in zip(ANGLES, axes, strict=True):
            plot.set_ylabel(f"{axis}, arcsec")
        axes[2].set_xlabel("time since it turns, h")
        legend(axes[0], 3)
        return svg(figure, f"bands-{key}")


def _lengths(words: Mapping[str, Runs]) -> str:
    """Error of the strapdown by the length of its words."""
    with settings():
        figure, plot = figure_and_axes(3.2)
        plot.axhspan(*FORTY, color=COLOUR["grey"], alpha=0.35, label="40 bits, prototype")
        for (key, deg_s), colour in zip(RATES.items(), ("heading", "pitch"), strict=True):
            for form, style in (("carried", "o-"), ("plain", "o--")):
                rms = [words[f"{key}_{w}"].pooled()[f"{form}_rms"] for w in WORDS]
                label = f"{deg_s:g} deg/s, {form}"
                plot.semilogy(WORDS, rms, style, color=COLOUR[colour], label=label)
        plot.set(xlabel="bits of a word", ylabel="error, rms, arcsec", xticks=WORDS)
        legend(plot, 5)
        return svg(figure, "lengths")
