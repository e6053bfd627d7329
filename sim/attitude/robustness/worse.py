"""Single runs that are worse than the rival's, with the deviations of the field.

Where a magnetometer is misled, every filter that believes it is; which one is led further astray,
and when, is seen beside what the field does in truth: turned to the reference's frame, how far it
points from north, how far its dip and its norm are from their medians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.accuracy.peers import dip_rad, peer, run_peer
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.attitude.robustness.runs import Campaign, log_of, name_of, prepared, run_ours
from boresight.sim.attitude.robustness.summary import RIVAL, SMALL_DEG, WORSE
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error
from boresight.sim.rotations.outputs import attitude_of
from boresight.sim.rotations.rotation import rotate

__all__ = ["curves", "explained", "field_off", "worse_runs"]


#: Time between two points of a curve, s, and the most points.
STEP_S, POINTS = 0.5, 400
#: Most runs of an estimator whose curves are shown, each of another trial.
CURVES = 8


def worse_runs(
    cases: Sequence[Case], runs: Sequence[Mapping[str, Any]], name: str
) -> list[dict[str, Any]]:
    """Runs whose judged figure is more than `WORSE` times the rival's, the worst first.

    Each with ``trial``, ``case``, ``ratio``, and both figures ``ours`` and ``rival`` [deg].
    """
    judged = {case.name: case.judged for case in cases}
    results = []
    for run in runs:
        figure = judged[run["case"]]
        rows = {row["estimator"]: row for row in run["rows"] if row["level"] != "float"}
        ours, rival = (rows.get(n, {}).get(figure) for n in (name, RIVAL))
        if ours is None or rival is None or ours <= WORSE * max(rival, SMALL_DEG):
            continue
        ratio = ours / max(rival, SMALL_DEG)
        summary = {"ratio": ratio, "ours": ours, "rival": rival, "figure": figure}
        results.append({"trial": run["trial"], "case": run["case"], **summary})
    return sorted(results, key=lambda run: -run["ratio"])


def field_off(log: NineAxis) -> dict[str, FloatArray]:
    """True deviations of the field, (n,) each; NaN where field or truth is not known.

    ``field_heading`` [deg]: how far it points from north, as far as a level compass is misled.
    ``field_dip`` [deg] and ``field_norm`` [%]: from their medians over the log.
    """
    e, n, u = rotate(log.attitude, log.mag).T
    norm, dip = np.linalg.norm(log.mag, axis=1), np.degrees(np.arctan2(-u, np.hypot(e, n)))
    with np.errstate(all="ignore"):
        share = 100.0 * (norm / np.nanmedian(norm) - 1.0) if np.isfinite(norm).any() else norm
        median_dip = np.nanmedian(dip) if np.isfinite(dip).any() else 0.0
    return {
        "field_heading": np.degrees(np.arctan2(e, n)),
        "field_dip": dip - median_dip,
        "field_norm": share,
    }


def _means(t: FloatArray, values: FloatArray, edges: FloatArray) -> list[float | None]:
    """Mean of the finite values between edges; None where there is none."""
    is_finite = np.isfinite(values)
    count, _ = np.histogram(t[is_finite], edges)
    total, _ = np.histogram(t[is_finite], edges, weights=values[is_finite])
    pairs = zip(total, count, strict=True)
    return [float(x / c) if c else None for x, c in pairs]


def curves(campaign: Campaign, name: str, run: Mapping[str, Any]) -> dict[str, Any]:
    """Both filters' errors over the time of a run, and the field's deviations, as plain data.

    Means over stretches of `STEP_S`, or longer where they were more than `POINTS`: ``t`` [s],
    ``ours`` and ``rival`` [deg] (the judged angle), those of `field_off`, and ``moves``, the share
    of samples that count.
    """
    case = {c.name: c for c in cases_of(campaign.protocol)}[run["case"]]
    trial = next(t for t in campaign.trials if name_of(t) == run["trial"])
    log = prepared(case, log_of(trial))
    fixed = attitude_of(run_ours(campaign, name, log)[1][0].outputs)
    rival = run_peer(peer(RIVAL), log.record(), dip_rad(log_of(trial)))
    t = log.t - log.t[0]
    edges = np.arange(0.0, t[-1] + STEP_S, max(STEP_S, t[-1] / POINTS))
    has_truth = np.asarray(np.isfinite(log.attitude).all(axis=1))
    reference = np.where(has_truth[:, None], log.attitude, [1.0, 0.0, 0.0, 0.0])
    columns = {
        label: np.where(has_truth, getattr(attitude_error(q, reference), run["figure"]), np.nan)
        for label, q in (("ours", fixed), ("rival", rival))
    }
    columns |= field_off(log) | {"moves": log.counts.astype(np.float64)}
    centres = 0.5 * (edges[:-1] + edges[1:])
    return {"t": centres.tolist(), **{n: _means(t, v, edges) for n, v in columns.items()}}


def explained(
    campaign: Campaign, cases: Sequence[Case], runs: Sequence[Mapping[str, Any]], name: str
) -> dict[str, Any]:
    """The runs of `worse_runs`, and `curves` of the worst one of each trial, `CURVES` at most."""
    results = worse_runs(cases, runs, name)
    first = {run["trial"]: run for run in reversed(results)}
    worst = sorted(first.values(), key=lambda run: -run["ratio"])[:CURVES]
    return {
        "estimator": name,
        "of": len(runs),
        "runs": results,
        "shown": [{**run, "curves": curves(campaign, name, run)} for run in worst],
    }
