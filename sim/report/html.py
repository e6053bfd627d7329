"""The report as one HTML file that needs nothing else: styles, charts and curves are inside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from boresight.model.declarations import EXACT_UNITS
from boresight.sim.report.chart import CHART_COLOURS, schedule_chart
from boresight.sim.report.plots import error_plot, log_difference_plot, output_plot
from boresight.sim.report.schedule import KINDS
from boresight.sim.report.sources import source_of

__all__ = ["render_html"]

#: What stands where nothing is known.
UNKNOWN = "\N{EM DASH}"


def number(x: Any, digits: int = 4) -> str:
    """A number for people: thousands apart, no more digits than say something."""
    if x is None:
        return UNKNOWN
    if x == 0 or 1e-3 <= abs(x) < 1e9:
        whole = isinstance(x, int) or float(x).is_integer() or abs(x) >= 10 ** (digits - 1)
        text = f"{x:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}") if whole else f"{x:.{digits}g}"
    else:
        mantissa, exponent = f"{x:.{min(digits, 3) - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}\N{MULTIPLICATION SIGN}10" + str(int(exponent)).translate(_RAISED)
    return text.replace("-", "\N{MINUS SIGN}")


_RAISED = str.maketrans(
    "-0123456789",
    "\N{SUPERSCRIPT MINUS}"
    + "".join(
        chr(c) for c in (0x2070, 0xB9, 0xB2, 0xB3, 0x2074, 0x2075, 0x2076, 0x2077, 0x2078, 0x2079)
    ),
)


def unit(text: str) -> str:
    """A unit as people write it."""
    text = "half turns" if text == "ht" else text
    return text.replace("^2", "\N{SUPERSCRIPT TWO}").replace("uT", "\N{MICRO SIGN}T")


def net_name(text: str) -> str:
    """A name out of the netlist; those that synthesis made up say nothing."""
    return "(made by synthesis)" if text.startswith("$") else text


def _worst(outputs: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The output that uses most of its tolerance; those without one come last."""

    def used(o: Mapping[str, Any]) -> tuple[bool, float]:
        largest = math.inf if o["max"] is None else float(o["max"])
        if o["tolerance"] is None:
            return False, largest
        return True, largest / o["tolerance"] if o["tolerance"] else largest * 1e300

    return max(outputs, key=used)


def _range_bar(row: Mapping[str, Any]) -> dict[str, float] | None:
    """Where the observed range lies within the format, both ends in percent of the bar."""
    low, high = row["observed_min"], row["observed_max"]
    if low is None or high is None:
        return None
    bottom, top = row["format_min"], row["format_max"]
    left, right = (100.0 * (x["value"] - bottom) / (top - bottom) for x in (low, high))
    left, right = max(0.0, left), min(100.0, right)
    return {"left": round(min(left, 99.0), 2), "width": round(max(right - left, 1.0), 2)}


def _plots(log: Mapping[str, Any]) -> dict[str, str | None]:
    series, other = log["series"], log["reference"] or "comparison"
    outputs, turned = series["outputs"], series["vs_log_deg"]
    along = "sample" if log["seconds"] is None else "time from the first sample, s"
    t = (series["t"], along)
    inexact = any(o["unit"] not in EXACT_UNITS for o in outputs.values())
    return {
        "outputs": output_plot(*t, outputs, other, salt="outputs"),
        "errors": error_plot(*t, outputs, salt="errors") if inexact else None,
        "vs_log": log_difference_plot(*t, turned, other, salt="log") if turned else None,
    }


def _named(row: Mapping[str, Any]) -> bool:
    """Whether a value is part of the estimator's interface or needs attention."""
    return (
        row["kind"] in ("input", "param", "state")
        or row["output"]
        or row["state"] in ("saturated", "tight")
    )


def _finite(data: Mapping[str, Any]) -> None:
    """ValueError if the data holds what JSON cannot."""

    def walk(x: Any, path: str) -> None:
        if isinstance(x, Mapping):
            for key, value in x.items():
                walk(value, f"{path}.{key}")
        elif isinstance(x, list | tuple):
            for k, value in enumerate(x):
                walk(value, f"{path}.{k}")
        elif isinstance(x, float) and not math.isfinite(x):
            raise ValueError(f"{path[1:]} must be finite, not {x!r}")

    walk(data, "")


def render_html(data: Mapping[str, Any]) -> str:
    """HTML text of the dict that `sim.report.data.report_data` builds.

    The file is self-contained: no script, no address outside, printable.

    Raises
    ------
    ValueError
        If a number is not finite.
    """
    import jinja2

    _finite(data)
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals["worst"] = _worst
    environment.filters |= {"number": number, "unit": unit, "net_name": net_name}
    template = environment.from_string(
        files("boresight.sim.report").joinpath("report.html").read_text(encoding="utf-8")
    )
    rows = data["numerics"]
    return template.render(
        d=data,
        unknown=UNKNOWN,
        source=lambda path: source_of(data, path) or "",
        chart=schedule_chart(data["schedule"]),
        colours=CHART_COLOURS,
        kinds=KINDS,
        plots=[_plots(log) for log in data["accuracy"]["logs"]],
        tables=[
            (
                "Inputs, parameters, states, outputs, and what needs attention",
                True,
                [(r, _range_bar(r)) for r in rows if _named(r)],
            ),
            ("All other values", False, [(r, _range_bar(r)) for r in rows if not _named(r)]),
        ],
    )
