"""Figures of many draws: means and spreads with confidence bands, NEES, NIS, spread over the bound.

A mean of n draws has the band +-1.96 sd/sqrt(n), a standard deviation sd sqrt(chi2/(n - 1)); NEES
and NIS of f degrees of freedom, averaged over n independent draws, the band chi2(n f)/n. Quantiles
of chi2 by Wilson and Hilferty (Proc. Natl. Acad. Sci. 17, 1931): within a hundredth from ten
degrees on. NIS counts every record: a correct filter has white innovations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray

__all__ = ["chi2", "figures", "text"]

_Z = 1.959963984540054  #: normal quantile of 95 %, two-sided.


def chi2(freedom: float, z: float) -> float:
    """Quantile of chi2 that has the probability of the normal quantile ``z``."""
    part = 2.0 / (9.0 * freedom)
    return freedom * max(1.0 - part + z * math.sqrt(part), 0.0) ** 3


def band(freedom: float, scale: float) -> list[float]:
    """95 % of chi2/scale."""
    return [chi2(freedom, -_Z) / scale, chi2(freedom, _Z) / scale]


def figures(
    draws: Sequence[Mapping[str, Any]], bound: Mapping[str, FloatArray], freedom: int
) -> dict[str, Any]:
    """Plain data of a campaign.

    Parameters
    ----------
    draws : sequence of mapping
        Results of `sim.montecarlo.campaign`, in the order of their seeds.
    bound : mapping of str to (records,)
        Least standard deviations, by output.
    freedom : int
        Of the innovations.

    Returns
    -------
    dict
        ``runs``, ``marks``; ``outputs`` by name with lists over the marks: ``mean``, ``mean_band``
        (half of it), ``sd``, ``sd_band`` (two), ``rms``, ``bound`` and ``ratio`` of sd to it;
        ``nees`` with ``mean`` and ``band``, per degree of freedom; ``nis`` the same, one number;
        ``worst``, see `_worst`.
    """
    n = len(draws)
    marks = np.array(draws[0]["marks"])
    outputs = {}
    for name in draws[0]["errors"]:
        e = np.array([d["errors"][name] for d in draws])
        sd = e.std(axis=0, ddof=1)
        low, high = (math.sqrt(v) for v in band(n - 1, n - 1))
        entry = {
            "mean": e.mean(axis=0),
            "mean_band": _Z / math.sqrt(n) * sd,
            "sd": sd,
            "sd_band": np.stack([sd / high, sd / low if low > 0.0 else np.full_like(sd, np.inf)]),
            "rms": np.sqrt(np.mean(e**2, axis=0)),
        }
        if name in bound:
            bounds = np.asarray(bound[name], dtype=np.float64)[marks]
            has_bound = np.isfinite(bounds) & (bounds > 0.0)
            entry |= {
                "bound": np.where(has_bound, bounds, np.nan),
                "ratio": np.where(has_bound, sd / np.where(has_bound, bounds, 1.0), np.nan),
            }
        outputs[name] = {key: _plain(v) for key, v in entry.items()}
    out: dict[str, Any] = {"runs": n, "marks": marks.tolist(), "outputs": outputs}
    f = draws[0]["freedom"]
    if f:
        nees = np.array([d["nees"] for d in draws]).mean(axis=0) / f
        out["nees"] = {"freedom": f, "mean": _plain(nees), "band": band(n * f, n * f)}
    count = sum(d["nis"][1] for d in draws)
    if freedom and count:
        total = sum(d["nis"][0] for d in draws) / freedom / count
        out["nis"] = {
            "freedom": freedom,
            "mean": total,
            "band": band(count * freedom, count * freedom),
        }
    return out | {"saturated": sum(d["saturated"] for d in draws), "worst": _worst(draws)}


def _worst(draws: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The draw in which most updates saturated; of equal ones, that with the largest last error.

    Errors are compared by their ratio to the root mean square of the output over the draws.
    """
    names = [*draws[0]["errors"]]
    last = np.abs([[d["errors"][name][-1] for name in names] for d in draws])
    with np.errstate(all="ignore"):
        times = np.nan_to_num(last / np.sqrt(np.mean(last**2, axis=0)), nan=0.0)
    times = np.where(np.isfinite(last), times, np.inf)
    k = max(range(len(draws)), key=lambda k: (draws[k]["saturated"], times[k].max()))
    j = int(np.argmax(times[k]))
    worst = {"seed": draws[k]["seed"], "output": names[j], "saturated": draws[k]["saturated"]}
    return worst | {"error": _plain(last[k])[j], "times_rms": _plain(times[k])[j]}


def _verdict(mean: float, low: float, high: float) -> str:
    """Verdict on a filter by a squared error over its variance."""
    if mean > high:
        return "too sure, errors are larger than the filter says (more noise)"
    if mean < low:
        return "too cautious, errors are smaller than the filter says (less noise)"
    return "consistent"


def _plain(values: FloatArray) -> Any:
    """Lists with None for values that are not finite."""
    if values.ndim > 1:
        return [_plain(row) for row in values]
    return [float(v) if math.isfinite(v) else None for v in values]


#: Of the table: figure, width and digits of a column.
_COLUMNS = (("mean", 13, 4), ("mean_band", 11, 3), ("sd", 12, 4), ("bound", 12, 4), ("ratio", 8, 4))


def text(data: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """The last mark as a table."""
    lines = [f"{'output':22s}{'mean error':>13s}{'+-':>11s}{'sd':>12s}{'bound':>12s}{'ratio':>8s}"]
    for name, entry in data["outputs"].items():
        line = f"{name:22s}"
        for key, width, digits in _COLUMNS:
            value = entry[key][-1] if key in entry else None
            line += f"{'-' if value is None else f'{value:.{digits}g}':>{width}s}"
        lines.append(f"{line} {units.get(name, '')}".rstrip())
    scope = {
        "nees": f", in record {data['marks'][-1]} of each draw:",
        "nis": ", over all updates that measure:",
    }
    for key, mean in (
        ("nees", data.get("nees", {}).get("mean", [None])[-1]),
        ("nis", data.get("nis", {}).get("mean")),
    ):
        if mean is None and key in data:
            lines.append(
                f"{key.upper()}{scope[key]} no number, "
                "since an error is none or a covariance is not positive"
            )
        elif mean is not None:
            low, high = data[key]["band"]
            lines.append(
                f"{key.upper()} per degree of freedom{scope[key]} {mean:.3f}, "
                f"95 % of {low:.3f} to {high:.3f}: {_verdict(mean, low, high)}"
            )
    lines.append(f"{data['runs']} draws, saturated updates: {data['saturated']}")
    return "\n".join(lines)
