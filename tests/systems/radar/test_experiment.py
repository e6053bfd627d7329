"""The radars' experiment: runs, bound, page."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from boresight.systems.radar import experiment
from boresight.systems.radar.bound import covariances, deviations, jacobian
from boresight.systems.radar.experiment import AT, Radar
from boresight.systems.radar.interface import BIASES
from boresight.systems.radar.page import render
from boresight.systems.radar.runs import UNITS, first, predicted, watch
from boresight.systems.radar.world import NOISE, TwoRadars, placed, seen_from
from tests.support.radar_figures import found, spread, targets, theory, watched

# -- the radar experiment: figures of runs that are known, which of them is judged how ------------


def test_figures() -> None:
    data = found()
    assert data["registration_fixed_float_percent"] == 0.02
    assert data["registration_range_2_percent"] == pytest.approx(1.5)
    assert data["registration_range_1_spread_ratio"] == 1.0
    assert data["registration_range_1_mean_offset"] == pytest.approx(0.5)
    assert data["registration_range_1_bound_percent"] == pytest.approx(250.0)
    assert data["registration_track_1_gain_percent"] == pytest.approx(98.0)
    assert data["registration_track_1_gain_noise_percent"] == pytest.approx(80.0)
    assert AT == 800


def verdicts(**more: float) -> dict[str, bool]:
    return {f"{t.name}, {t.part}": t.good for t in targets(**more) if t.binding}


def test_targets_fall_where_their_figure_does() -> None:
    assert all(verdicts().values())
    for key, value, name in (
        ("registration_range_1_percent", 2.1, "noise-free, 80 s, range 1"),
        ("registration_azimuth_2_percent", 0.16, "noise-free, 80 s, azimuth 2"),
        ("registration_azimuth_1_spread_ratio", 1.16, "spread over the bound, azimuth 1"),
        ("registration_azimuth_1_spread_ratio", 0.86, "spread over the bound, azimuth 1"),
        ("registration_range_2_mean_offset", -1.1, "mean error, in bands, range 2"),
        ("registration_fixed_float_percent", 0.11, "fixed less float64, "),
        ("registration_saturated", 1.0, "words beyond their range, "),
        ("registration_interval_cycles_fast", 761.0, "cycles to the next record, fast"),
        ("registration_track_2_gain_percent", 95.0, "tracks better, noise-free, radar 2"),
    ):
        wrong = [n for n, good in verdicts(**{key: value}).items() if not good]
        assert wrong == [name]


def test_what_the_bound_forbids_does_not_bind() -> None:
    forbidden = [t for t in targets() if not t.binding]
    assert len(forbidden) == 6 and not any(t.good for t in forbidden)


def test_run(monkeypatch) -> None:
    """Which run is asked for, and that page and figures hold together."""
    asked = []

    def watch(world, params):
        asked.append((world.noises.any(), len(world.place), params["p0_range_1"]))
        return watched(1.0 if not world.noises.any() else 10.0)

    monkeypatch.setattr(experiment, "watch", watch)
    monkeypatch.setattr(experiment, "campaign", lambda seed, runs, say, jobs: spread())
    monkeypatch.setattr(experiment, "predicted", lambda *a: theory())
    cycles = dict.fromkeys(("small", "fast"), (SimpleNamespace(interval=700),))
    monkeypatch.setattr(experiment, "schedules_of", lambda *a: cycles)
    few = [t.name for t in Radar().run(seed=3, runs=20, say=lambda text: None).targets if t.fewest]
    assert few == 6 * ["spread over the bound"] + 6 * ["mean error, in bands"]
    del asked[:]
    result = Radar().run(seed=3, runs=250, say=lambda text: None)
    assert asked[:2] == [(False, 1701, 1000.0), (True, 1701, 5.0)]
    assert [a[:2] for a in asked[2:]] == 5 * [(False, 801)]
    json.dumps([result.figures, result.details], allow_nan=False)
    assert not any(t.fewest for t in result.targets)
    assert result.good and result.pages["radar.html"].count("no estimator can") == 6


def test_a_short_campaign() -> None:
    """Two draws, here, of the real thing."""

    data = experiment.campaign(1, 2, lambda text: None, 1)
    assert data["runs"] == 2 and data["marks"][-1] == AT
    assert data["nis"]["mean"] == pytest.approx(1.0, abs=0.1)


# -- one run and its theory: errors against the world's truth, spreads against draws --------------


def test_a_run_is_what_world_and_filter_say() -> None:
    world = TwoRadars(noise=0.0, seconds=20.0)
    run = watch(world, first(1e3, 10.0) | {"correct_from": 10.0})
    assert run.t[-1] == pytest.approx(20.0) and run.error.shape == (201, 6)
    assert (run.error[0] == -1.0).all()  # nothing is known at first
    assert np.abs(run.error[-1, [2, 5]]).max() < 0.1
    assert run.before[50] == pytest.approx(run.after[50], abs=0.01)
    assert np.abs(run.after[-1]).max() < 0.2 * np.abs(run.before[-1]).max()
    assert run.saturated == 0 and run.deviation < 1e-3


def test_first_is_in_noise_units() -> None:
    p = first(50.0, 0.5)
    assert p["p0_range_2"] == 5.0 and p["p0_azimuth_1"] == pytest.approx(0.5 / 0.15)


def test_theory_is_that_of_a_linear_filter() -> None:
    """Estimates of simulated linear measurements have the spread and the mean error predicted."""
    world = TwoRadars(seconds=4.0)
    theory = predicted(world, 50.0, 0.5)
    prior = np.array([50.0, 0.5, 0.5] * 2) * UNITS
    noise = np.array(NOISE) * UNITS
    h = np.concatenate([world.jacobians()[0], -world.jacobians()[1]], axis=2)
    r = np.linalg.inv(h @ np.diag(noise**2) @ h.transpose(0, 2, 1))
    gain = h.transpose(0, 2, 1) @ r
    p = np.linalg.inv(np.einsum("nij,njk->ik", gain, h) + np.diag(prior**-2.0))
    rng = np.random.default_rng(1)
    v = noise * rng.normal(size=(4000, len(h), 6))
    z = np.einsum("nij,j->ni", h, world.bias) + np.einsum("nij,rnj->rni", h, v)
    errors = np.einsum("nij,rnj->ri", gain, z) @ p - world.bias
    assert errors.std(axis=0) == pytest.approx(theory.sd[-1], rel=0.05)
    assert (np.abs(errors.mean(axis=0) - theory.mean[-1]) < 4 * theory.sd[-1] / 63.0).all()
    assert theory.bayes[-1] == pytest.approx(np.sqrt(np.diag(p)), rel=1e-6)
    total = np.einsum("nij,njk->ik", gain, h)
    both = np.concatenate([np.eye(3), np.eye(3)])
    wanted = np.sqrt(np.diag(np.linalg.inv(both.T @ total @ both)))
    assert theory.equal[-1] == pytest.approx(wanted, rel=1e-3)
    assert np.linalg.norm(theory.weak) == pytest.approx(1.0)


# -- the bound against plain matrices, differences, and the figures of the geometry ---------------

WORLD = TwoRadars(seconds=170.0)
DEG = np.pi / 180.0
BOUND_NOISE = np.array([10.0, 0.07 * DEG, 0.15 * DEG] * 2)


def test_jacobian_is_the_derivative() -> None:
    site, seen = WORLD.sites[0], WORLD.seen[0][::400]
    outcome = jacobian(site, seen)
    for k, step in enumerate((1.0, 1e-6, 1e-6)):
        d = np.zeros(3)
        d[k] = step
        wanted = (placed(site, seen + d) - placed(site, seen - d)) / (2.0 * step)
        assert outcome[:, :, k] == pytest.approx(wanted, rel=1e-6, abs=1e-3)
    assert seen_from(site, placed(site, seen)) == pytest.approx(seen)


def test_bound_is_the_inverse_of_the_sum() -> None:
    jacobians = [j[:50] for j in WORLD.jacobians()]
    prior = np.array([50.0, 0.5 * DEG, 0.5 * DEG] * 2)
    total = np.diag(prior**-2.0)
    for a, b in zip(*jacobians, strict=True):
        h = np.concatenate([a, -b], axis=1)
        total = total + h.T @ np.linalg.inv(h @ np.diag(BOUND_NOISE**2) @ h.T) @ h
    wanted = np.sqrt(np.diag(np.linalg.inv(total)))
    assert deviations(covariances(jacobians, BOUND_NOISE, prior))[-1] == pytest.approx(
        wanted, rel=1e-6
    )


def test_without_a_prior_ranges_are_hardly_determined() -> None:
    """At 80 s 1,545 and 1,200 m, at 170 s 202 and 182 m; nothing at all at first."""
    outcome = deviations(covariances(WORLD.jacobians(), BOUND_NOISE, np.full(6, np.inf)))
    assert np.isinf(outcome[0]).all()
    assert outcome[800, [0, 3]] == pytest.approx([1545.0, 1200.0], rel=0.01)
    assert outcome[1700, [0, 3]] == pytest.approx([202.0, 182.0], rel=0.01)
    assert outcome[800, [1, 2, 4, 5]] / DEG == pytest.approx([0.33, 0.085, 0.27, 0.043], rel=0.03)
    assert (np.diff(outcome[1:][np.isfinite(outcome[1:, 0])], axis=0) <= 1e-9).all()
    weak = np.linalg.eigh(covariances(WORLD.jacobians(), BOUND_NOISE, np.full(6, np.inf))[800])
    assert weak.eigenvalues[-1] > 30.0 * weak.eigenvalues[-2]


# -- the page: every bias, every verdict, four plots, nothing from outside ------------------------


def test_everything_is_on_the_page() -> None:
    data = found(registration_range_1_percent=3.0)
    goals = targets(registration_range_1_percent=3.0)
    text = render(watched(1.0), watched(10.0), theory(), spread(), data, goals)
    for b in BIASES:
        assert b.replace("_", " radar ") in text
    assert text.count("<svg") == 4 == text.count("<figcaption>")
    assert text.count(">FAIL</span>") == 7 and text.count(">FAIL</span> (reported)") == 6
    assert text.count("no estimator can") == 6
    assert "http" not in text and "<script" not in text
    again = render(watched(1.0), watched(10.0), theory(), spread(), data, goals)
    assert text == again
