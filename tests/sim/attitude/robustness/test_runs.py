"""Runs of a protocol: figures of a case, times to settle, what a journal keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.robustness import runs
from boresight.sim.attitude.robustness.logs import carrier
from boresight.sim.attitude.robustness.plan import cases_of
from boresight.sim.attitude.robustness.runs import Campaign, figures_of, settled_s, tasks_of
from boresight.sim.campaign import Journal, complete
from boresight.sim.rotations.rotation import euler_to_quaternion, quaternion_multiply

CAMPAIGN = Campaign("short", ("carrier:ship:1",), ("complementary",), ("vqf_online",))


def test_settling_is_until_it_stays() -> None:
    t = np.arange(400) / 10.0
    error = np.full(400, 1.0)
    assert settled_s(t, error, 2.0) == 0.0
    error[:50] = 3.0
    error[80] = 3.0
    assert settled_s(t, error, 2.0) == pytest.approx(8.0)
    error[100:] = np.nan
    assert settled_s(t, error, 2.0) is None
    assert settled_s(t, np.full(400, 5.0), 2.0) is None
    error[:] = np.nan
    assert settled_s(t, error, 2.0) is None


def test_the_first_second_does_not_count() -> None:
    log = carrier("ship", 1, seconds=20.0)
    q = log.attitude.copy()
    turn = euler_to_quaternion(np.radians([0.0, 0.0, 3.0]))
    q[:50] = quaternion_multiply(turn, q[:50])
    result = figures_of(log, q)
    assert result["total"] == pytest.approx(0.0, abs=1e-5)
    assert result["settled_2"] == pytest.approx(0.98) and result["settled_5"] == 0.0
    q[50:] = quaternion_multiply(turn, q[50:])
    assert figures_of(log, q)["heading"] == pytest.approx(3.0)


def test_an_estimator_has_the_full_scale_of_the_case() -> None:
    """And keeps it for no other case; a value that the campaign gives is before it."""
    (fast,) = (case for case in cases_of("full") if case.name == "fast turns")
    log = fast.work(carrier("drone", 1, seconds=20.0))
    campaign = Campaign("full", (), ("mekf",), ())
    given = Campaign("full", (), ("mekf",), (), params=(("mekf", (("gyro_most_sq", 1500.0),)),))
    results = [
        runs.run_ours(c, "mekf", log, scale)[1][0].outputs["status"]
        for c, scale in ((campaign, ()), (campaign, ("gyr",)), (campaign, ()), (given, ("gyr",)))
    ]
    late = [(np.rint(status).astype(int) >> 6 & 1).sum() for status in results]
    assert late[1] > 100 and late[0] == late[2] == late[3] == 0


def test_what_is_in_the_journal_is_not_run_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = [c for c in cases_of("short") if c.name in ("as recorded", "never a field")]
    monkeypatch.setattr(runs, "cases_of", lambda protocol: wanted)
    monkeypatch.setattr(runs.carriers, "carrier", lambda name, seed: carrier(name, seed, seconds=9))
    runs.log_with_digest.cache_clear()
    path, messages = tmp_path / "a.runs", list[str]()
    cases = tasks_of(CAMPAIGN)
    first = complete(CAMPAIGN, runs.run_cases, cases, Journal(path), say=messages.append)
    again = complete(CAMPAIGN, None, cases, Journal(path), say=messages.append)
    runs.log_with_digest.cache_clear()
    assert again == first and messages[-1].startswith("2 of 2 runs are in ")
    assert [run["case"] for run in first] == ["as recorded", "never a field"]
    fixed, floating, rival = first[0]["rows"]
    assert (fixed["level"], floating["level"], rival["level"]) == ("fixed", "float", "package")
    assert fixed["total"] == pytest.approx(floating["total"], abs=1e-3) and fixed["good"]
    assert 0.0 < fixed["apart_deg"] < 1e-3 and fixed["saturated"] == 0
    assert first[1]["rows"][2]["inclination"] < 5.0


def test_the_identity_knows_program_and_parameters() -> None:
    other = Campaign(*(getattr(CAMPAIGN, n) for n in ("protocol", "trials", "estimators", "peers")))
    assert other.identity() == CAMPAIGN.identity()
    tuned = runs.params_key({"complementary": {"force_gain": 1.0}})
    assert tuned == (("complementary", (("force_gain", 1.0),)),)


def test_an_estimator_without_attitude_is_refused() -> None:
    with pytest.raises(InputError, match="outputs are an attitude"):
        Campaign("short", (), ("registration",), ()).identity()
