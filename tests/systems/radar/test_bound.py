"""The bound against plain matrices, differences, and the figures of the geometry."""

import numpy as np
import pytest

from boresight.systems.radar.bound import covariances, deviations, jacobian
from boresight.systems.radar.world import TwoRadars, placed, seen_from

WORLD = TwoRadars(seconds=170.0)
DEG = np.pi / 180.0
NOISE = np.array([10.0, 0.07 * DEG, 0.15 * DEG] * 2)


def test_jacobian_is_the_derivative() -> None:
    site, seen = WORLD.sites[0], WORLD.seen[0][::400]
    found = jacobian(site, seen)
    for k, step in enumerate((1.0, 1e-6, 1e-6)):
        d = np.zeros(3)
        d[k] = step
        wanted = (placed(site, seen + d) - placed(site, seen - d)) / (2.0 * step)
        assert found[:, :, k] == pytest.approx(wanted, rel=1e-6, abs=1e-3)
    assert seen_from(site, placed(site, seen)) == pytest.approx(seen)


def test_bound_is_the_inverse_of_the_sum() -> None:
    jacobians = [j[:50] for j in WORLD.jacobians()]
    prior = np.array([50.0, 0.5 * DEG, 0.5 * DEG] * 2)
    total = np.diag(prior**-2.0)
    for a, b in zip(*jacobians, strict=True):
        h = np.concatenate([a, -b], axis=1)
        total = total + h.T @ np.linalg.inv(h @ np.diag(NOISE**2) @ h.T) @ h
    wanted = np.sqrt(np.diag(np.linalg.inv(total)))
    assert deviations(covariances(jacobians, NOISE, prior))[-1] == pytest.approx(wanted, rel=1e-6)


def test_without_a_prior_ranges_are_hardly_determined() -> None:
    """At 80 s 1,545 and 1,200 m, at 170 s 202 and 182 m; nothing at all at first."""
    found = deviations(covariances(WORLD.jacobians(), NOISE, np.full(6, np.inf)))
    assert np.isinf(found[0]).all()
    assert found[800, [0, 3]] == pytest.approx([1545.0, 1200.0], rel=0.01)
    assert found[1700, [0, 3]] == pytest.approx([202.0, 182.0], rel=0.01)
    assert found[800, [1, 2, 4, 5]] / DEG == pytest.approx([0.33, 0.085, 0.27, 0.043], rel=0.03)
    assert (np.diff(found[1:][np.isfinite(found[1:, 0])], axis=0) <= 1e-9).all()
    weak = np.linalg.eigh(covariances(WORLD.jacobians(), NOISE, np.full(6, np.inf))[800])
    assert weak.eigenvalues[-1] > 30.0 * weak.eigenvalues[-2]
