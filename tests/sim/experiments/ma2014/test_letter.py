"""The float references: inverse of the measurement, kinematics against scipy, gains."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.sim.attitude.rotation import euler_to_matrix
from boresight.sim.experiments.ma2014.letter import _rates, filter_to_the_letter, mag_acc_angles
from boresight.sim.experiments.ma2014.world import E2, FIELD_UT, LOOP_HZ, noise_free_log
from boresight.sim.records.nine_axis import NineAxis

RNG = np.random.default_rng(7)


def test_mag_acc_angles_invert_the_measurement():
    euler = RNG.uniform((-1.4, -3.0, -3.0), (1.4, 3.0, 3.0), (200, 3))
    c = euler_to_matrix(euler)
    acc = np.einsum("nij,i->nj", c, (0.0, 0.0, 9.81))
    for field in (FIELD_UT, (-3.0, 27.0, -40.0)):
        mag = np.einsum("nij,i->nj", c, field)
        np.testing.assert_allclose(mag_acc_angles(acc, mag, field), euler, atol=1e-12)


@pytest.mark.parametrize(
    ("as_printed", "sequence", "order"), [(False, "ZXY", (1, 2, 0)), (True, "ZYX", (2, 1, 0))]
)
def test_each_set_of_rates_belongs_to_its_sequence(as_printed, sequence, order):
    x = RNG.uniform(-1.2, 1.2, (50, 3))  # theta, gamma, psi
    w = RNG.uniform(-1.0, 1.0, (50, 3))
    h = 1e-6
    angles = np.empty_like(x)
    for k, place in enumerate(order):
        angles[:, place] = x[:, k]
    turned = Rotation.from_euler(sequence, angles) * Rotation.from_rotvec(w * h)
    change = (turned.as_euler(sequence) - angles) / h
    np.testing.assert_allclose(_rates(x, w, as_printed), change[:, list(order)], atol=2e-5)


def test_noise_free_the_letter_follows_the_truth_and_the_print_does_not():
    log = NineAxis.of(noise_free_log(E2, LOOP_HZ))
    measured = mag_acc_angles(log.acc, log.mag, FIELD_UT)
    zero = (0.0, 0.0, 0.0)
    for gains, worst in ((zero, 2e-3), ((0.1414, 0.1414, 0.1), 1e-3)):
        out = filter_to_the_letter(measured, log.gyr, 1 / LOOP_HZ, gains, zero)
        assert np.degrees(np.abs(out - measured)).max() < worst
        bad = filter_to_the_letter(measured, log.gyr, 1 / LOOP_HZ, gains, zero, as_printed=True)
        assert np.degrees(np.abs(bad - measured)).max() > 1.5


def test_gains_are_per_sample():
    n = 40
    measured = np.zeros((n, 3))
    measured[0] = (0.1, 0.2, 0.3)
    out = filter_to_the_letter(measured, np.zeros((n, 3)), 0.125, (0.1, 0.2, 0.5), (0.0,) * 3)
    k = np.arange(n)[:, None]
    np.testing.assert_allclose(out, measured[0] * (1 - np.array((0.1, 0.2, 0.5))) ** k, atol=1e-12)


def test_integral_learns_the_bias():
    n, bias = 6000, np.array((0.01, -0.02, 0.03))
    gyr, kp = np.tile(bias, (n, 1)), (0.1,) * 3
    out = filter_to_the_letter(np.zeros((n, 3)), gyr, 0.125, kp, (0.002,) * 3)
    proportional = filter_to_the_letter(np.zeros((n, 3)), gyr, 0.125, kp, (0.0,) * 3)
    # the prediction, which adds a step of the bias, then meets the measurement
    np.testing.assert_allclose(out[-1, :2] + 0.125 * bias[:2], 0.0, atol=1e-4)
    assert abs(out[-1, 2] + 0.125 * bias[2]) < 1e-4
    np.testing.assert_allclose(proportional[-1], 9 * 0.125 * bias, rtol=0.1)


def test_residual_is_wrapped():
    measured = np.full((3, 3), 0.0)
    measured[:, 2] = (np.pi - 0.01, -np.pi + 0.01, -np.pi + 0.01)
    out = filter_to_the_letter(measured, np.zeros((3, 3)), 0.125, (0.5,) * 3, (0.0,) * 3)
    assert abs(out[1, 2]) == pytest.approx(np.pi, abs=1e-12)
