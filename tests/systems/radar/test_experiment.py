"""The radars' experiment: runs, bound, page."""

import numpy as np
import pytest

from boresight.systems.radar.experiment import UNITS, predicted
from boresight.systems.radar.world import (
    NOISE,
    TwoRadars,
    covariances,
    deviations,
    jacobian,
    placed,
    seen_from,
)

# -- one run and its theory: errors against the world's truth, spreads against draws --------------


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
