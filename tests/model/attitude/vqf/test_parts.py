"""VQF's parts: rest, motion, field, bias, settings."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from vqf import PyVQF

from boresight.model.algebra.covariance import symmetric
from boresight.model.attitude.vqf.bias import bias_of, measured
from boresight.model.attitude.vqf.field import heading_of
from boresight.model.attitude.vqf.interface import interface_of
from boresight.model.attitude.vqf.motion import made_vertical
from boresight.model.attitude.vqf.rest import rest_of
from boresight.model.attitude.vqf.settings import CLIP_RAD_S, DEGREE, Settings

# -- the magnetometer's part by itself: the heading's gain, disturbances, a new reference ---------

SETTINGS = Settings(20.0, 20.0)
PARAMS = SimpleNamespace(**{p.name: p.default for p in interface_of(SETTINGS)[1]})
LEVEL = np.eye(3).tolist()
EARTH = np.array([0.0, 20.0, -40.0])


class Field:
    """Samples one after the other; the body is level and points to where ``delta`` says."""

    def __init__(self) -> None:
        self.x = {s.name: s.initial for s in interface_of(SETTINGS)[2]}

    def __call__(self, field: Any, turning: bool = True, restart: bool = False) -> Any:
        x = SimpleNamespace(**{name: np.float64(value) for name, value in self.x.items()})
        result = heading_of(x, restart, LEVEL, tuple(np.asarray(field)), turning, PARAMS, SETTINGS)
        self.x |= {name: float(value) for name, value in result.states.items()}
        return result


def turned(angle_ht: float, field: Any = EARTH) -> Any:
    """A field whose horizontal part points that far east of north."""
    a = np.pi * angle_ht
    return np.array([np.sin(a) * field[1], np.cos(a) * field[1], field[2]])


def accepted(field: Field, value: Any = EARTH) -> int:
    """Samples until a field is not disturbed."""
    for n in range(1, 1000):
        if not field(value).disturbed:
            return n
    raise AssertionError("never")


def test_a_field_is_taken_over_after_five_seconds_of_turning() -> None:
    assert SETTINGS.candidate_samples[0] in (100, 101)  # a hundred steps may sum up to less
    assert accepted(Field()) == 1 + SETTINGS.candidate_samples[0]  # the first one begins it
    field = Field()
    assert all(field(EARTH, turning=False).disturbed for _ in range(300))


@pytest.mark.parametrize(
    "other, odd",
    [
        (1.08 * EARTH, False),
        (1.15 * EARTH, True),
        (0.85 * EARTH, True),
        (np.array([0.0, 26.0, -36.4]), False),  # 9 deg less dip
        (np.array([0.0, 28.0, -35.0]), True),
    ],
)
def test_norm_and_dip_tell_a_disturbance(other: Any, odd: bool) -> None:
    field = Field()
    accepted(field)
    for _ in range(20):  # the low-pass of 0.05 s
        result = field(other, turning=False)
    assert result.disturbed == odd
    back = [bool(field(EARTH).disturbed) for _ in range(20)]
    # It ends half a second after the low-pass of one sample has followed.
    assert back == ([True] * (back.index(False)) + [False] * (20 - back.index(False)))
    assert (10 <= back.index(False) <= 13) == odd


def test_a_disturbance_is_rejected_for_a_minute_and_then_followed_by_half() -> None:
    field = Field()
    accepted(field)
    for _ in range(2000):  # past the first samples, and all patience there again
        field(EARTH)
    odd = turned(0.2, 1.5 * EARTH)
    before = field.x["delta"]
    field(odd), field(odd)
    moved = []
    for _ in range(1300):
        at = field.x["delta"]
        field(odd, turning=False)
        moved.append(field.x["delta"] - at)
    assert moved[:1190] == [0.0] * 1190
    first = next(k for k, m in enumerate(moved) if m != 0.0)
    assert 1195 <= first + 2 <= 1202
    wanted = 0.5 * SETTINGS.mag_gain * (0.2 - before)
    assert moved[first] == pytest.approx(wanted, rel=1e-3)


# -- the bias's Kalman filter is the textbook's, with a matrix inverse ----------------------------


def lists(m: Any) -> Any:
    return symmetric(3, lambda i, j: float(m[i, j]))


@pytest.fixture
def drawn() -> tuple[Any, ...]:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3))
    p = 0.05 * root @ root.T
    r = np.linalg.qr(rng.normal(size=(3, 3)))[0] * 0.8
    return p, r, rng.uniform(-1.0, 1.0, 3), np.array([1.0, 0.3, 1e-3])


def test_one_component_after_the_other_is_all_at_once(drawn: tuple[Any, ...]) -> None:
    p, r, e, w = drawn
    most = float(p.max())
    change, after = measured(lists(p), r.tolist(), e.tolist(), w.tolist(), most, (False, 9.0))
    K = p @ r.T @ np.linalg.inv(np.diag(1.0 / w) + r @ p @ r.T)
    assert np.array(change) == pytest.approx(K @ e, abs=1e-14)
    assert np.array(after) == pytest.approx(p - K @ r @ p, abs=1e-14)
    _, anew = measured(lists(p), r.tolist(), e.tolist(), w.tolist(), most, (True, 9.0))
    assert np.array(anew).tolist() == np.diag([9.0] * 3).tolist()


def _state(settings: Settings, bias: list[float]) -> Any:
    """At rest in the low-passes: C is one, C b the bias; P at its start."""
    held = dict.fromkeys((f"p{i}{j}" for i in range(3) for j in range(i, 3)), 0.0)
    held |= {f"p{i}{i}": settings.start_variance for i in range(3)}
    b, _, a2 = settings.vertical.coefficients
    for i, row in enumerate("enu"):
        for j, column in enumerate("xyz"):
            held[f"c_z_{row}{column}"] = (1.0 - b) * (i == j)
            held[f"c_v_{row}{column}"] = (1.0 - a2) * (i == j)
        held |= {f"b_z_{row}": (1.0 - b) * bias[i], f"b_v_{row}": (1.0 - a2) * bias[i]}
    return SimpleNamespace(**held)


@pytest.mark.parametrize("resting", [True, False])
def test_what_is_measured(resting: bool) -> None:
    """At rest the mean rate; in motion, level, (-n, e)/Ts of the correction."""
    settings = Settings(50.0, 50.0)
    bias, rate = [0.1, -0.2, 0.05], [0.5 * CLIP_RAD_S, 0.25 * CLIP_RAD_S, -CLIP_RAD_S]
    turn = (2e-5, 1e-5)
    weights = settings.vertical.weights(False, 0.01)
    learnt, P, _ = bias_of(
        _state(settings, bias),
        False,
        weights,
        np.eye(3).tolist(),
        bias,
        turn,
        rate,
        resting,
        settings,
    )
    if resting:
        error = np.array([0.5, 0.25, -1.0]) - bias
        w = np.ones(3)
    else:
        error = np.array([-50.0 * turn[1] / CLIP_RAD_S, 50.0 * turn[0] / CLIP_RAD_S, -bias[2]])
        w = settings.motion_weight * np.array([1.0, 1.0, 1e-4])
    p = settings.start_variance
    gain = p / (p + 1.0 / w)
    assert np.array(learnt) == pytest.approx(bias + gain * np.clip(error, -1.0, 1.0), abs=1e-9)
    assert np.diagonal(P) == pytest.approx(p * (1.0 - gain), rel=1e-9)


# -- coefficients are those of the authors' own implementation ------------------------------------


@pytest.mark.parametrize("rate, mag_rate", [(100.0, 100.0), (285.714, 28.5714), (50.0, 12.0)])
def test_as_the_package_has_them(rate: float, mag_rate: float) -> None:
    s = Settings(rate, mag_rate)
    theirs: Any = PyVQF(1.0 / rate, magTs=1.0 / mag_rate).coeffs
    for low_pass, kind in ((s.vertical, "accLp"), (s.rest, "restGyrLp"), (s.field, "magNormDipLp")):
        b, a1, a2 = low_pass.coefficients
        assert [b, 2 * b, b] == pytest.approx(getattr(theirs, f"{kind}B"), rel=1e-9)
        assert [a1, a2] == pytest.approx(getattr(theirs, f"{kind}A"), rel=1e-12)
    assert s.mag_gain == pytest.approx(theirs.kMag)
    assert s.field_gain == pytest.approx(theirs.kMagRef)
    assert s.start_variance == pytest.approx(theirs.biasP0 / theirs.biasRestW)
    assert s.growth == pytest.approx(theirs.biasV / theirs.biasRestW)
    assert s.motion_weight == pytest.approx(theirs.biasRestW / theirs.biasMotionW)


@pytest.mark.parametrize("rate", [10.0, 25.0, 50.0, 100.0, 142.857, 256.0, 285.714, 1000.0])
def test_samples_are_sums_of_float64(rate: float) -> None:
    s = Settings(rate, rate)
    step = 1.0 / rate

    def summed(n: int) -> float:
        total = 0.0
        for _ in range(n):
            total += step
        return total

    for n, seconds in (
        (s.rest_samples, 1.5),
        (s.calm_samples, 0.5),
        *zip(s.candidate_samples, (5.0, 20.0), strict=True),
        (s.rejected_samples + 1, 60.0 + 1e-300),
    ):
        assert summed(n - 1) < seconds <= summed(n) or n == s.rejected_samples + 1
    assert summed(s.rejected_samples) <= 60.0 < summed(s.rejected_samples + 1)
    gain, n = 1.0, 0
    while gain != 0.0:  # as the package counts them
        gain, n = gain / (gain + 1.0), n + 1
        gain = 0.0 if gain * 9.0 < step else gain
    assert s.first_samples == n


# -- when the body rests, and when it does not ----------------------------------------------------

REST_SETTINGS = Settings(50.0, 50.0)
REST_PARAMS = SimpleNamespace(**{p.name: p.default for p in interface_of(REST_SETTINGS)[1]})


def still(gyro: Any, force: Any) -> tuple[list[float], list[Any]]:
    """Samples counted after each one, and the mean rates."""
    x = {s.name: s.initial for s in interface_of(REST_SETTINGS)[2]}
    counts, rates = [], []
    for n, (g, f) in enumerate(zip(gyro, force, strict=True)):
        u = dict(zip(("gx", "gy", "gz", "ax", "ay", "az"), (*g, *f), strict=True))
        x["count"] = min(float(n), 512.0)
        count, rate, after = rest_of(
            SimpleNamespace(**x), SimpleNamespace(**u), REST_PARAMS, 1.0 / (n + 1.0), REST_SETTINGS
        )
        x |= after | {"still": count}
        counts.append(float(count))
        rates.append([float(c) for c in rate])
    return counts, rates


def steady(n: int, rate: Any = (0.0, 0.0, 0.0)) -> tuple[Any, Any]:
    return np.tile(np.array(rate) * DEGREE, (n, 1)), np.tile([0.0, 0.0, 9.81], (n, 1))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_no_rest_with_more_than_the_largest_bias(axis: int) -> None:
    rate = np.zeros(3)
    rate[axis] = -2.01
    assert max(still(*steady(60, rate))[0]) == 1.0  # counted anew at every sample


@pytest.mark.parametrize(
    "kind, size, broken",
    [("gyr", 2.2 * DEGREE, True), ("gyr", 1.8 * DEGREE, False), ("acc", 0.56, True)]
    + [("acc", 0.45, False)],
)
def test_a_blow_breaks_it(kind: str, size: float, broken: bool) -> None:
    gyro, force = steady(100)
    (gyro if kind == "gyr" else force)[80, 1] += size
    counts, _ = still(gyro, force)
    # A gyro's blow restarts the count, an accelerometer's sets it to zero for its sample.
    assert counts[79] == 80.0
    assert counts[80] == ((1.0 if kind == "gyr" else 0.0) if broken else 81.0)


# -- turns of VQF against scipy's -----------------------------------------------------------------


def scipy_of(q: Any) -> Rotation:
    return Rotation.from_quat([*q[1:], q[0]])


@pytest.fixture
def motion_drawn() -> Any:
    rng = np.random.default_rng(2)
    q, v = rng.normal(size=(50, 4)), rng.normal(size=(50, 3))
    return q / np.linalg.norm(q, axis=1, keepdims=True), v


def test_the_shortest_turn_to_the_vertical(motion_drawn: Any) -> None:
    for q, v in zip(*motion_drawn, strict=True):
        unit = v / np.linalg.norm(v)
        after, turn = made_vertical(list(q), *unit)
        # Beyond 120 deg half a turn about x comes first.
        over = Rotation.from_rotvec([np.pi if unit[2] < -0.5 else 0.0, 0.0, 0.0])
        whole = scipy_of(after) * scipy_of(q).inv()
        done, unit = whole * over.inv(), over.apply(unit)
        assert done.apply(unit) == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
        assert done.as_rotvec()[2] == pytest.approx(0.0, abs=1e-12)  # no heading
        assert done.magnitude() == pytest.approx(np.arccos(unit[2]))
        for w in np.eye(3):
            assert np.array(turn(w)) == pytest.approx(whole.apply(w), abs=1e-12)
