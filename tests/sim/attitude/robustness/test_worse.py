"""Runs that are worse than the rival's, and the curves that show why."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.sim.attitude.robustness import runs
from boresight.sim.attitude.robustness.logs import carrier
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.attitude.robustness.runs import Campaign, run_cases
from boresight.sim.attitude.robustness.worse import curves, explained, field_off, worse_runs
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import euler_to_quaternion, quaternion_conjugate, rotate

CAMPAIGN = Campaign("short", ("carrier:ship:1",), ("complementary",), ("vqf_online",))


def run(trial: str, ours: float | None, rival: float, case: str = "as recorded") -> Any:
    figures = {} if ours is None else {"total": ours, "inclination": 0.5 * ours}
    return {
        "trial": trial,
        "case": case,
        "rows": [
            {"estimator": "mine", "level": "fixed", **figures},
            {"estimator": "mine", "level": "float", "total": 99.0, "inclination": 99.0},
            {"estimator": "vqf_online", "level": "package", "total": rival, "inclination": rival},
        ],
    }


def test_more_than_15_per_cent_worse_the_worst_first() -> None:
    cases = [Case("as recorded", "a", lambda x: x), Case("blind", "b", lambda x: x, "inclination")]
    runs = [
        run("a", 1.16, 1.0),
        run("b", 1.14, 1.0),
        run("c", 0.57, 0.01),  # both small
        run("d", 3.0, 1.0),
        run("e", 3.0, 1.0, "blind"),
        run("f", None, 1.0),
    ]
    result = worse_runs(cases, runs, "mine")
    assert [(r["trial"], r["ratio"]) for r in result] == [("d", 3.0), ("e", 1.5), ("a", 1.16)]
    assert result[1] == {
        "trial": "e", "case": "blind", "ratio": 1.5, "ours": 1.5, "rival": 1.0,
        "figure": "inclination",
    }  # fmt: skip


def test_what_the_field_does() -> None:
    """A field of norm 50 and dip 60 deg; a tenth of the log it is turned, dips, is larger."""
    n = 200
    q = euler_to_quaternion(np.random.default_rng(1).uniform(-1.5, 1.5, (n, 3)))
    east, dip, norm = np.zeros(n), np.full(n, 60.0), np.full(n, 50.0)
    east[:10], dip[10:15], norm[15:20] = 7.0, 55.0, 60.0
    flat = norm * np.cos(np.radians(dip))
    a = np.radians(east)
    field = np.stack([flat * np.sin(a), flat * np.cos(a), -norm * np.sin(np.radians(dip))], axis=1)
    mag = rotate(quaternion_conjugate(q), field)
    mag[20] = q[21] = np.nan
    zero = np.zeros((n, 3))
    result = field_off(NineAxis("x", np.arange(n) / 100.0, zero, zero, mag, q))
    assert np.isnan(result["field_heading"][[20, 21]]).all() and np.isnan(result["field_norm"][20])
    known = np.r_[:20, 22:n]
    for key, wanted in (
        ("field_heading", east),
        ("field_dip", dip - 60.0),
        ("field_norm", 2.0 * norm - 100.0),
    ):
        assert result[key][known] == pytest.approx(wanted[known], abs=1e-9)
    blind = field_off(NineAxis("x", np.arange(n) / 100.0, zero, zero, np.full((n, 3), np.nan), q))
    assert all(np.isnan(v).all() for v in blind.values())


def test_curves_are_the_errors_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    log = carrier("ship", 1, seconds=20.0)
    q = log.attitude.copy()
    q[:100] = np.nan
    still = replace(log, q=q, mov=log.t > log.t[0] + 5.0)
    monkeypatch.setattr(runs.carriers, "carrier", lambda name, seed: still)
    runs.log_with_digest.cache_clear()
    (one,) = run_cases(CAMPAIGN, [("carrier:ship:1", "as recorded")])
    fixed, _, rival = one["rows"]
    entry = {"trial": "ship-1", "case": "as recorded", "figure": "total"}
    result = curves(CAMPAIGN, "complementary", entry)
    t = np.array(result["t"])
    assert np.diff(t) == pytest.approx(0.5) and {len(v) for v in result.values()} == {len(t)}
    assert result["ours"][0] is None and result["moves"][0] == 0.0 and result["moves"][-1] == 1.0
    for key, row in (("ours", fixed), ("rival", rival)):
        counts = np.array(result[key], dtype=np.float64)[t > 5.0]
        assert np.sqrt(np.mean(counts**2)) == pytest.approx(row["total"], rel=0.02)
    assert fixed["total"] != pytest.approx(rival["total"], rel=0.1)
    several = [{**one, "rows": [{**fixed, "total": x}, rival]} for x in (90.0, 80.0)]
    whole = explained(CAMPAIGN, cases_of("short"), [one, *several], "complementary")
    assert [r["ours"] for r in whole["runs"]][:2] == [90.0, 80.0] and whole["of"] == 3
    assert [r["ours"] for r in whole["shown"]] == [90.0]  # one of each trial
    assert whole["shown"][0]["curves"] == result
    runs.log_with_digest.cache_clear()
