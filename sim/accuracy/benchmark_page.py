"""The accuracy page: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from boresight.model.declarations import ATTITUDE
from boresight.sim.accuracy.benchmark_plots import (
    difference_plot,
    mean_plot,
    style_of,
    total_of,
    trial_plot,
)
from boresight.sim.accuracy.figures import ANGLES
from boresight.sim.pages import UNKNOWN, degrees, page

__all__ = ["render_page"]


def _best(rows: list[Mapping[str, Any]], trial: str, reference: str) -> float | None:
    """Least total RMSE of a trial among the rows, but for the reference itself."""
    values = [
        total_of(t)
        for r in rows
        for t in r["trials"]
        if t["trial"] == trial and r["estimator"] != reference
    ]
    return min((x for x in values if x is not None), default=None)


def render_page(data: Mapping[str, Any]) -> str:
    """HTML text of the dict that `boresight accuracy` gives."""
    without_float = [r for r in data["estimators"] if r["level"] != "float"]
    rows = [r for r in without_float if r["attitude"]]
    floating = {r["estimator"]: r for r in data["estimators"] if r["level"] == "float"}
    groups: dict[str, list[str]] = {}
    for log in data["logs"]:
        groups.setdefault(log["reference"], []).append(log["trial"])
    truth = groups.get("truth", [])
    ranked = sorted(
        rows, key=lambda r: float("inf") if (x := (r["mean"] or {}).get("total")) is None else x
    )
    compared = [r for r in rows if r["vs_float"]]
    names = [log["trial"] for log in data["logs"]]
    return page(
        "boresight.sim.accuracy",
        "benchmark.html",
        deg=degrees,
        d=data,
        rows=ranked,
        attitude=ATTITUDE,
        no_angles=dict.fromkeys(ANGLES),
        floating=floating,
        groups=groups,
        truth=truth,
        compared=compared,
        folders=list(without_float[0]["mean_by_folder"]),
        style=style_of(rows),
        unknown=UNKNOWN,
        cell=lambda row, trial: next(t for t in row["trials"] if t["trial"] == trial),
        best={log["trial"]: _best(rows, log["trial"], log["reference"]) for log in data["logs"]},
        others=[r for r in without_float if not r["attitude"]],
        near={r["estimator"]: {d["output"]: d for d in r["vs_float"]} for r in without_float},
        mean=mean_plot(rows, salt="mean") if truth and rows else None,
        dots={
            kind: trial_plot(
                [r for r in rows if r["estimator"] != kind],
                trials,
                salt=f"dots-{kind}",
                label="total RMSE, deg (logarithmic)"
                if kind == "truth"
                else "total RMS difference, deg (logarithmic)",
            )
            for kind, trials in groups.items()
            if rows
        },
        difference=difference_plot(rows, names, salt="difference") if compared else None,
    )
