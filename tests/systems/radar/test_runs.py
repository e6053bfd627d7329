"""One run and its theory: errors against the world's truth, spreads against draws."""

import numpy as np
import pytest

from boresight.systems.radar.runs import UNITS, first, predicted, watch
from boresight.systems.radar.world import NOISE, TwoRadars


def test_a_run_is_what_world_and_filter_say() -> None:
    world = TwoRadars(noise=0.0, seconds=20.0)
    run = watch(world, first(1e3, 10.0) | {"correct_from": 10.0})
    assert run.t[-1] == pytest.approx(20.0) and run.error.shape == (201, 6)
    assert (run.error[0] == -1.0).all()  # nothing is known at first
    assert np.abs(run.error[-1, [2, 5]]).max() < 0.1
    assert run.before[50] == pytest.approx(run.after[50], abs=0.01)
    assert np.abs(run.after[-1]).max() < 0.2 * np.abs(run.before[-1]).max()
    assert run.saturated == 0 and run.apart < 1e-3


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
