"""Antennas and decks."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.systems.mls.deck import SensorErrors, deck, records
from boresight.systems.mls.linear_array import Array, direction, lobe
from boresight.systems.mls.patterns import Trial, patterns_of
from boresight.systems.mls.prototype import _jacobian, _picard, prototype

# -- patterns in closed form and summed, displacements, main lobes --------------------------------


def phases(array: Array, azimuth: float) -> np.ndarray:
    along = direction(azimuth, 0.0)[1]
    return (array.spacing * along * np.arange(array.elements))[None, :] % 1.0


@pytest.mark.parametrize("array", [Array(), Array(16), Array(24, 0.8)])
def test_summed_pattern_is_the_closed_form(array: Array) -> None:
    azimuth = np.linspace(-89.0, 89.0, 700)
    for beam in (-40.0, 0.0, 62.0):
        result = np.abs(array.field(phases(array, beam), direction(azimuth, 0.0)))[:, 0]
        of = math.sin(math.radians(beam))
        wanted = array.closed_form(np.sin(np.radians(azimuth)), of)
        assert np.abs(result - wanted).max() < 1e-12
        assert array.closed_form(of, of) == 1.0


def test_a_rigid_turn_is_a_turn_of_the_direction_and_a_displacement_is_not() -> None:
    array = Array(16)
    turn = math.radians(10.0)
    place = 0.5 * np.arange(16)
    moved = np.zeros((1, 16, 3))
    moved[0, :, 0], moved[0, :, 1] = -place * math.sin(turn), place * (math.cos(turn) - 1.0)
    e = direction(25.0, 0.0)
    as_displacement = array.field(phases(array, 25.0), e, moved)[0, 0]
    as_turn = array.field(phases(array, 25.0), direction(15.0, 0.0))[0]
    assert as_displacement == pytest.approx(as_turn, abs=1e-12)
    assert abs(as_turn) < 0.3
    again = array.field(phases(array, 15.0), e, moved)[0, 0]  # what compensation does
    assert abs(again) == pytest.approx(1.0)


@pytest.mark.parametrize("axis, b", [(0, 0.1), (0, 0.5), (1, 0.5), (2, 0.5)])
def test_mean_gain_of_displaced_elements(axis: int, b: float) -> None:
    """exp(-(2 pi b d c/lambda)^2/2), in the mean over draws of the field itself."""
    array, e = Array(), direction(50.0, 20.0)
    q = array.displacements(axis, b, 4000, np.random.default_rng(1))
    assert q[:, :, axis].std() == pytest.approx(0.5 * b, rel=0.01)
    assert not np.delete(q, axis, axis=2).any()
    steer = (0.5 * e[1] * np.arange(64))[None, :]
    result = array.field(steer, e, q).mean()
    wanted = math.exp(-((2.0 * math.pi * b * 0.5 * e[axis]) ** 2) / 2.0)
    assert result.real == pytest.approx(wanted, abs=0.01) and abs(result.imag) < 0.01


def test_gate_of_a_known_pulse() -> None:
    """A triangle of half width 4 about 10.3: -3 dB at 1 - sqrt(1/2) of it to each side."""
    scan = np.linspace(-62.0, 62.0, 2481)
    shape = np.maximum(1.0 - np.abs(scan - 10.3) / 4.0, 0.02)
    shape[200] = 0.25
    pulse = lobe(scan, np.stack([0.5 * shape, shape[::-1]]), 4.0)
    assert pulse.centre == pytest.approx([10.3, -10.3], abs=1e-3)
    assert pulse.width == pytest.approx([8.0 * (1.0 - math.sqrt(0.5))] * 2, abs=2e-3)
    assert pulse.peak == pytest.approx([0.5, 1.0], abs=0.02)
    assert pulse.sidelobe_db == pytest.approx([-12.04] * 2, abs=0.02)
    single = lobe(scan, shape, 4.0)
    assert single.centre.shape == () and float(single.centre) == pytest.approx(10.3, abs=1e-3)


def test_a_pulse_at_the_end_of_the_scan_is_cut() -> None:
    scan = np.linspace(-62.0, 62.0, 1241)
    pulse = lobe(scan, np.maximum(1.0 - np.abs(scan - 62.0) / 4.0, 0.0), 4.0)
    assert pulse.centre == pytest.approx(62.0 - 2.0 * (1.0 - math.sqrt(0.5)), abs=0.01)


# --------------------------------------------------------------------------------------------------
# patterns of displaced elements against the closed form, and what the paper's figures show


@pytest.fixture(scope="module")
def found() -> dict[str, Trial]:
    return patterns_of(Array(), 3.0, 40, 7)


def test_gain_is_the_closed_form(found: dict[str, Trial]) -> None:
    for name, trial in found.items():
        gain, closed = trial.figures["gain"], trial.figures["closed"]
        floor = 0.07 if closed < 0.6 else 0.03  # of an amplitude, which noise makes larger
        assert closed - 0.03 < gain < closed + floor, name
        assert trial.shown.max() <= 1.0 and len(trial.shown) == 2481


def test_figures_3_to_5(found: dict[str, Trial]) -> None:
    assert found["x_05_0"].figures["wrong"] > 0.1 and found["x_05_60"].figures["wrong"] == 0.0
    assert found["y_05_0"].figures["sd"] < 1e-9 and found["y_05_0"].figures[
        "gain"
    ] == pytest.approx(1.0, abs=1e-6)
    assert found["x_01_0"].figures["width"] == pytest.approx(1.59, abs=0.02)
    assert found["x_01_m60"].figures["width"] == pytest.approx(3.18, abs=0.04)
    assert found["x_01_0"].figures["sd"] < 0.08
    low, high = found["z_05_0"].figures["sidelobe_db"], found["z_05_0_at_30"].figures["sidelobe_db"]
    assert low == pytest.approx(-17.5, abs=0.4) and high > -13.5


# -- decks and their sensors, against scipy's rotations -------------------------------------------

EXACT = SensorErrors(0.0, (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def attitude(what) -> Rotation:
    return Rotation.from_euler("ZYX", what.euler[:, ::-1])


def test_the_table_jumps_by_eight_degrees_in_sixty_ms() -> None:
    euler = np.degrees(deck("table", 5.0, 1).euler)
    for k, at in enumerate((1500, 3000, 4500)):
        jump = euler[at + 60, k] - euler[at, k]
        assert jump == pytest.approx(8.0, abs=0.8), k
    assert not euler[0].any()


def test_exact_sensors() -> None:
    what = deck("sea_6", 1.0, 5, 130.0)
    u, r = records(what, 5, EXACT, dip_deg=30.0), attitude(what)
    assert u[0, 0] == -1e-3 and (u[1:, 0] == 1e-3).all()
    turns = (r[:-1].inv() * r[1:]).as_rotvec() * 1000.0
    assert u[1:, 1:4] == pytest.approx(turns, abs=1e-9)
    field = r.inv().apply(50.0 * np.array([np.cos(np.pi / 6), 0.0, -0.5]))
    assert u[:, 7:] == pytest.approx(field, abs=1e-9)
    force = r.inv().apply(np.stack([0.0 * what.lift, 0.0 * what.lift, 9.80665 + what.lift], 1))
    assert u[:, 4:7] == pytest.approx(force, abs=1e-9) and np.ptp(what.lift) > 1e-3


# -- the dense filter against numerical Jacobians and exact motion --------------------------------


def seen(q: np.ndarray, v: tuple[float, float, float]) -> np.ndarray:
    """C^T V with C of (23), quadratic in q."""
    w, x, y, z = q
    c = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(c).T @ np.array(v)


def test_jacobian_is_that_of_the_transposed_matrix() -> None:
    q, v = np.array([0.5, -0.3, 0.7, 0.4]), (0.6, 0.2, -0.8)
    step = 1e-6
    rows = [(seen(q + step * e, v) - seen(q - step * e, v)) / (2 * step) for e in np.eye(4)]
    h = _jacobian(q[None], v)[0]
    assert h == pytest.approx(np.array(rows).T, abs=1e-8)
    assert h @ q == pytest.approx(2.0 * seen(q, v))


def test_picard_turns_to_the_third_order() -> None:
    turn = np.array([[0.06, -0.05, 0.06]])
    start = np.array([0.1, 0.7, -0.5, 0.5])
    after = _picard(turn)[0] @ start
    exact = Rotation.from_quat(np.roll(start, -1)) * Rotation.from_rotvec(turn[0])
    q = np.roll(exact.as_quat(), 1)
    q = q * np.sign(q @ after) * np.linalg.norm(start)
    assert after == pytest.approx(q, abs=3e-6)


def test_runs_follow_exact_sensors() -> None:
    decks = [deck("table", 2.0, seed, 50.0 * seed) for seed in (1, 2)]
    rows = np.stack([records(d, s, EXACT) for s, d in enumerate(decks)], axis=1)
    start = np.stack([d.q[0] for d in decks])
    rows[0, :, 0] = 0.0
    truth = np.stack([d.q for d in decks], axis=1)
    for options in ({"p0": 1e-4}, {"p0": 0.0, "r_sd": 1e6}):
        result = prototype(rows, start, **options)
        assert np.abs(np.abs((result * truth).sum(axis=2)) - 1.0).max() < 1e-8


def test_a_wrong_start_is_found() -> None:
    what = deck("rolling", 1.5, 3)
    rows = records(what, 3, EXACT)[:, None]
    result = prototype(rows, np.array([what.q[0] + [0, 0.03, 0, 0]]), p0=1e-2)
    assert abs(result[-1, 0] @ what.q[-1]) > 1.0 - 1e-8
