"""The page of the array experiment: targets, errors over hours, the paper's tables, words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from boresight.sim.experiments.array.cases import CASES, RATES
from boresight.sim.experiments.array.printed import BUDGET, HOURLY, SIGMA, statistics
from boresight.sim.experiments.array.runs import EVERY
from boresight.sim.experiments.array.words import FORTY, WORDS
from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.page import Section
from boresight.sim.experiments.page import render as page
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, band, figure_and_axes, legend, settings, svg
from boresight.sim.worlds.array.world import ANGLES, DT

__all__ = ["render"]

_INTRO = (
    "A radar array is aligned at rest for 300 s, erected to a pitch of 66 deg, and turned about "
    "the vertical for hours at 0.35 or 36 deg/s; gyros and accelerometers on it tell its attitude, "
    "and a mark on the turntable its azimuth once a turn. Wang Wenzhe et al. (2016) print errors "
    "after each hour. Here the integer program of the core runs through every sample, in C.",
    "Sensor errors are the paper's (gyro 0.003 deg/h, 1e-5, 20e-6; accelerometer 20 ug, 1e-4, "
    "20e-6), their signs drawn in every run, the start off by 5 arcsec of tilt and 20 of heading. "
    "As in the paper sensors have no noise, unless a case says so. Errors count from the first "
    "sample that turns.",
)
_SIGMA = (
    'The last row of Tables 4 and 5, "1 sigma", is the deviation of the eight hourly values from '
    "their own mean (n - 1). It leaves out the mean, and what happens between the hours. An hour "
    "is 3.5 turns at 0.35 deg/s, so odd hours are half a turn away from the mark and even hours at "
    "it: hence the alternation of Table 4. It is 360 whole turns at 36 deg/s: hours 1 to 7 of "
    "Table 5 are read right where the heading was just set (heading 0.05 to 1.12), and the eighth "
    'is not (52.03): without that one value its 1 sigma of {all:.2f} is {seven:.2f}. "All below '
    '40" holds of these deviations; single values reach {most:.2f} and 52.03. Our figures are root '
    "mean squares over all the time, with the mean in them."
)
_FLOOR = (
    "What is left is constant: gyro misalignments m = 20e-6 look like a tilt of "
    "m (cos^2 66 - sin^2 66) = -2.8 arcsec in pitch and m (sin 66 + cos 66)/cos 66 = 13.4 in roll "
    "where all signs are plus, and no state of the filter can tell them from the tilt."
)
_OVER = (
    "Errors of the first run over the hours, least and most of each 240th of them; the heading is "
    "worst before the filter has seen some turns."
)
_WORDS = (
    "The strapdown alone, perfect sensors that count in words of the same length; error of the "
    "worst angle while it turns, root mean square. Carried: remainders in a second word; plain: "
    "none. Grey: what a prototype in words of 40 bits had in eight hours (0.16 to 0.43 arcsec), "
    "the specification's reason to ask for them."
)
_COLUMNS = {
    **{f"{a} rms, most": (f"{a}_rms", f"{a}_max") for a in ANGLES},
    **{"1 sigma of the hours": tuple(f"{a}_sigma" for a in ANGLES)},
    **{"scale of the up gyro, ppm": ("scale_up_ppm",)},
    **{"indices used, refused": ("used_sum", "refused_sum")},
    **{"less float64, rms, most": ("fixed_float_rms", "fixed_float_max")},
}


def render(flown: Mapping[str, Runs], words: Mapping[str, Runs], targets: Sequence[Target]) -> str:
    """HTML text: no script, nothing outside."""
    heading = HOURLY["b"][:, 2]
    sigma = _SIGMA.format(
        all=heading.std(ddof=1), seven=heading[:7].std(ddof=1), most=np.abs(HOURLY["a"]).max()
    )
    parts = np.array([*BUDGET.values()])
    rows: list[list[str | float]] = [[name, *row] for name, row in BUDGET.items()]
    rows.append(["root of the sum of squares", *np.sqrt((parts[:-1] ** 2).sum(axis=0)).tolist()])
    bands = [(f"{deg_s:g} deg/s", _bands(flown, key)) for key, deg_s in RATES.items()]
    hourly = ("paper", "all errors plus", "draws, rms")
    return page(
        "array",
        _INTRO,
        targets,
        [
            Section(title="Errors over the hours", text=_OVER, figures=bands),
            Section(
                title="Tables 4 and 5: errors after each hour, arcsec",
                text=_FLOOR,
                columns=(
                    "hour: pitch, roll, heading",
                    *(f"{deg_s:g} deg/s, {what}" for deg_s in RATES.values() for what in hourly),
                ),
                rows=_hours(flown),
            ),
            Section(
                title='What "1 sigma" means',
                text=sigma,
                columns=(
                    "arcsec: pitch, roll, heading",
                    *(f"{deg_s:g} deg/s" for deg_s in RATES.values()),
                ),
                rows=_meaning(flown),
            ),
            Section(
                title="Table 1: heading by the old method, arcsec",
                text="A chain of parts, each with its share; Tables 2 and 3 are lost.",
                columns=("", "allocated", "real"),
                rows=rows,
            ),
            Section(title="How long words must be", text=_WORDS, figures=[("", _lengths(words))]),
            Section(
                title="Cases",
                text="Over all runs of each, arcsec where nothing else is said.",
                columns=("", "runs", *_COLUMNS),
                rows=_cases(flown),
            ),
        ],
    )


def _numbers(values: Iterable[float], form: str = ".2f") -> str:
    return ", ".join(f"{v:{form}}" for v in values).replace("-", "\N{MINUS SIGN}")


def _hours(flown: Mapping[str, Runs]) -> list[list[str | float]]:
    """Hourly errors: of the paper, of the run with all errors plus, and over the draws."""
    ours = {key: flown[f"{key}_plus"].each[0].hourly for key in RATES}
    drawn = {key: np.array([told.hourly for told in flown[f"{key}_index"].each]) for key in RATES}
    rows: list[list[str | float]] = []
    for hour in range(len(ours["a"])):
        row: list[str | float] = [str(hour + 1)]
        for key, printed in HOURLY.items():
            row.append(_numbers(printed[hour]) if hour < len(printed) else "")
            row.append(_numbers(ours[key][hour]))
            row.append(_numbers(np.sqrt(np.mean(drawn[key][:, hour] ** 2, axis=0))))
        rows.append(row)
    return rows


def _meaning(flown: Mapping[str, Runs]) -> list[list[str | float]]:
    """Statistics of the paper's hourly values, and of ours."""
    printed = {key: statistics(hourly) for key, hourly in HOURLY.items()}
    ours = {key: flown[f"{key}_index"].pooled() for key in RATES}
    rows: list[list[str | float]] = [["printed as 1 sigma", *map(_numbers, SIGMA.values())]]
    for name, kind in (
        ("deviation of the printed values", "sigma"),
        ("their root mean square", "rms"),
        ("their most", "most"),
    ):
        rows.append([name, *(_numbers(one[kind]) for one in printed.values())])
    for name, kind in (
        ("ours, deviation of the hours", "sigma"),
        ("ours, all the time, rms", "rms"),
        ("ours, most at any time", "max"),
    ):
        rows.append([name, *(_numbers(o[f"{a}_{kind}"] for a in ANGLES) for o in ours.values())])
    return rows


def _cases(flown: Mapping[str, Runs]) -> list[list[str | float]]:
    rows: list[list[str | float]] = []
    for name, case in CASES.items():
        found = flown[name].pooled()
        row: list[str | float] = [case.meaning, str(len(flown[name].each))]
        for keys in _COLUMNS.values():
            shown = case.compared or not keys[0].startswith("fixed")
            row.append(_numbers((found[key] for key in keys), ".3g") if shown else "")
        rows.append(row)
    return rows


def _bands(flown: Mapping[str, Runs], key: str) -> str:
    """Errors of the first run with each reading of the index."""
    with settings():
        figure, axes = figure_and_axes(6.0, 3, sharex=True)
        for name, colour in (("none", "grey"), ("literal", "amber"), ("index", "heading")):
            label = CASES[f"{key}_{name}"].meaning.partition(", ")[2]
            style = {"color": COLOUR[colour], "label": label, "alpha": 0.75, "linewidth": 0.8}
            for one, error in zip(axes, flown[f"{key}_{name}"].each[0].error.T, strict=True):
                band(one, error, EVERY * DT / 3600.0, 240, **style)
        for axis, one in zip(ANGLES, axes, strict=True):
            one.set_ylabel(f"{axis}, arcsec")
        axes[2].set_xlabel("time since it turns, h")
        legend(axes[0], 3)
        return svg(figure, f"bands-{key}")


def _lengths(words: Mapping[str, Runs]) -> str:
    """Error of the strapdown by the length of its words."""
    with settings():
        figure, one = figure_and_axes(3.2)
        one.axhspan(*FORTY, color=COLOUR["grey"], alpha=0.35, label="40 bits, prototype")
        for (key, deg_s), colour in zip(RATES.items(), ("heading", "pitch"), strict=True):
            for form, style in (("carried", "o-"), ("plain", "o--")):
                rms = [words[f"{key}_{w}"].pooled()[f"{form}_rms"] for w in WORDS]
                label = f"{deg_s:g} deg/s, {form}"
                one.semilogy(WORDS, rms, style, color=COLOUR[colour], label=label)
        one.set(xlabel="bits of a word", ylabel="error, rms, arcsec", xticks=WORDS)
        legend(one, 5)
        return svg(figure, "lengths")
