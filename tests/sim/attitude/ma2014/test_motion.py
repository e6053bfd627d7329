"""Attitude against scipy; rates, accelerations and forces against derivatives of the attitude."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.attitude.ma2014.motion import StackedMotion, Swing

R = math.radians
#: All three stages turned, each still swinging when looked at.
ALL = StackedMotion(
    (Swing(0, R(-40), 8.0, 1.3), Swing(1, R(30), 5.0, 1.2), Swing(2, R(55), 3.0, 4.0, phase=0.4))
)
H = 1e-4


class Together(StackedMotion):
    """All stages swing at once: every term of the kinematics counts."""

    def stages(self, t):
        parts = [swing.at(np.asarray(t)) for swing in self.swings]
        return tuple(np.stack([p[k] for p in parts], axis=1) for k in range(3))


TOGETHER = Together(ALL.swings)


def inside(motion, count=50):
    """Times more than 2 H away from where a swing begins or ends."""
    t = np.random.default_rng(1).uniform(0.0, motion.seconds, count)
    edges = np.cumsum([0.0, *(s.seconds for s in motion.swings)])
    return t[np.abs(t[:, None] - edges).min(axis=1) > 3 * H]


def test_stages_move_one_after_the_other_and_stay_where_they_were_left():
    motion = StackedMotion((Swing(0, R(10), 4.0, 0.25), Swing(2, R(20), 2.0, 1.0)))
    angle, rate, acceleration = motion.stages(np.array([-1.0, 0.0, 0.5, 1.0, 1.5, 3.0, 9.0]))
    w = 2 * math.pi / 4.0
    np.testing.assert_allclose(
        np.degrees(angle[:, 0]), [0, 0, 10 * math.sin(w * 0.5), 10, 10, 10, 10], atol=1e-12
    )
    np.testing.assert_allclose(np.degrees(angle[:, 2]), [0, 0, 0, 0, 20, 0, 0], atol=1e-12)
    assert not angle[:, 1].any()
    # standing still before and after; the instant of a change belongs to the later swing
    assert not rate[0].any() and not rate[-1].any() and not acceleration[-1].any()
    assert rate[1, 0] == pytest.approx(R(10) * w)
    assert rate[3, 0] == 0.0 and rate[3, 2] == pytest.approx(R(20) * math.pi)


def test_a_stage_stands_at_its_start_until_its_first_swing():
    motion = StackedMotion((Swing(0, R(10), 4.0, 1.0), Swing(1, R(20), 2.0, 0.5, math.pi / 2)))
    angle, rate, _ = motion.stages(np.array([-1.0, 2.0]))
    np.testing.assert_allclose(np.degrees(angle[:, 1]), 20.0)
    assert not rate[:, 1].any()


def test_attitude_is_the_stack_of_the_stages():
    t = inside(ALL)
    angles, _, _ = ALL.stages(t)
    np.testing.assert_allclose(
        ALL.matrix(t), Rotation.from_euler("XYZ", angles).as_matrix(), atol=1e-14
    )
    q = Rotation.from_euler("XYZ", angles).as_quat(scalar_first=True)
    np.testing.assert_allclose(np.abs(np.sum(q * ALL.attitude(t), axis=1)), 1.0, atol=1e-14)


@pytest.mark.parametrize("motion", [ALL, TOGETHER], ids=["in turn", "together"])
def test_rates_are_the_derivatives_of_the_attitude(motion):
    t = inside(motion)
    w, w_dot = motion.rates(t)
    assert (np.abs(w).max(axis=0) > 0.3).all()
    turn = np.swapaxes(motion.matrix(t - H), 1, 2) @ motion.matrix(t + H)
    np.testing.assert_allclose(w, Rotation.from_matrix(turn).as_rotvec() / (2 * H), atol=2e-7)
    change = (motion.rates(t + H)[0] - motion.rates(t - H)[0]) / (2 * H)
    np.testing.assert_allclose(w_dot, change, atol=2e-6)


def test_stage_rates_are_the_derivatives_of_the_stage_angles():
    t = inside(ALL)
    _, rate, acceleration = ALL.stages(t)
    (a, ra, _), (b, rb, _) = ALL.stages(t - H), ALL.stages(t + H)
    np.testing.assert_allclose(rate, (b - a) / (2 * H), atol=1e-6)
    np.testing.assert_allclose(acceleration, (rb - ra) / (2 * H), atol=1e-5)


def test_specific_force_at_rest_is_gravity_along_the_vertical():
    motion = StackedMotion((Swing(0, R(-90), 4.0, 0.25), Swing(1, R(30), 4.0, 0.25)))
    level, tilted, end = (
        motion.specific_force(np.array([-1.0, 1.0, 5.0]), gravity=9.8, lever=(0.1, 0.2, 0.3)) / 9.8
    )
    np.testing.assert_allclose(level, [0, 0, 1], atol=1e-15)
    # x stage at -90 deg: y' points down; the swing of y has just begun, with its lever force
    assert np.linalg.norm(tilted - [0, -1, 0]) < 0.05
    np.testing.assert_allclose(end, [0, -1, 0], atol=1e-12)


def test_a_lever_feels_the_second_derivative_of_its_place():
    r, g, h = np.array([0.3, -0.2, 0.5]), 9.81, 1e-3
    t = inside(TOGETHER)
    c0, c, c1 = (TOGETHER.matrix(t + d) for d in (-h, 0.0, h))
    acceleration_n = (c1 @ r - 2 * (c @ r) + c0 @ r) / h**2
    force = np.einsum("nij,ni->nj", c, acceleration_n + [0.0, 0.0, g])  # C^T (a + g)
    np.testing.assert_allclose(TOGETHER.specific_force(t, gravity=g, lever=r), force, atol=1e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Swing(3, 1.0, 1.0, 1.0), "axis must be 0, 1 or 2, not 3"),
        (lambda: Swing(0, 1.0, 0.0, 1.0), "period must be a finite number above 0, not 0.0"),
        (lambda: Swing(0, 1.0, 1.0, -1.0), "periods must be a finite number above 0, not -1.0"),
        (lambda: Swing(0, math.nan, 1.0, 1.0), "amplitude must be a finite number, not nan"),
        (lambda: StackedMotion(()), "swings must have at least one entry, not none"),
        (
            lambda: StackedMotion((Swing(0, R(10), 1.0, 0.25), Swing(0, R(10), 1.0, 1.0))),
            "swing 1 must start at 10 deg, where its stage stands, not 0 deg",
        ),
    ],
)
def test_bad_motions(make, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        make()
