"""Flights of known errors, and what a core that knows its attitude does to the beam."""

import math

import numpy as np
import pytest

from boresight.systems.mls.cases import Case
from boresight.systems.mls.deck import SensorErrors, deck
from boresight.systems.mls.linear_array import Array, direction
from boresight.systems.mls.runs import (
    AXES,
    SETTLED,
    Flight,
    beam_errors,
    figures_of,
    fly,
    phases_of,
    pooled,
)


def known(error: np.ndarray, motion: str = "table") -> Flight:
    """A flight that told the truth but for errors (n, runs, 3) [deg]."""
    seconds = len(error) / 1000.0
    decks = [deck(motion, seconds, seed) for seed in range(1, error.shape[1] + 1)]
    q = np.stack([d.q for d in decks], axis=1)
    n = len(decks)
    own = {"norm": np.linspace(0.8, 1.0, n), "fixed_float_deg": np.linspace(0.1, 0.25, n)}
    own |= {"fixed_float_rms_deg": np.full(n, 0.125), "saturated": np.full(n, 3.0)}
    return Flight(decks, error, q, own)


def flight_figures(flight: Flight) -> dict[str, float]:
    return pooled(figures_of(flight))


def test_figures_of_known_errors() -> None:
    error = np.zeros((4200, 2, 3))
    error[:SETTLED] = 50.0
    error[SETTLED:, 0], error[SETTLED:, 1] = [1.0, -2.0, 0.0], [1.0, 2.0, 3.0]
    found = flight_figures(known(error))
    assert [found[f"{a}_deg"] for a in AXES] == pytest.approx([1.0, 2.0, 3.0 / math.sqrt(2.0)])
    assert (found["worst_deg"], found["max_deg"]) == pytest.approx((3.0 / math.sqrt(2.0), 3.0))
    assert found["norm"] == pytest.approx(0.9) and found["saturated"] == 6.0
    assert (found["fixed_float_deg"], found["fixed_float_rms_deg"]) == (0.25, 0.125)
    encoder = flight_figures(known(np.zeros((4200, 1, 3))))["encoder_deg"]
    assert encoder == pytest.approx(360.0 / 4096.0 / math.sqrt(12.0), rel=0.05)


@pytest.mark.parametrize("lag", [0, 7])
def test_lag_of_a_delayed_answer(lag: int) -> None:
    truth = np.degrees(deck("table", 4.2, 1).euler)
    error = np.zeros((4200, 1, 3))
    error[lag:, 0] = truth[: 4200 - lag] - truth[lag:] + 0.3
    assert flight_figures(known(error))["lag_ms"] == lag


def test_the_lag_is_that_of_all_runs_together() -> None:
    """A run whose own lag is another one does not count alone."""
    runs = figures_of(known(np.zeros((4200, 1, 3))))
    runs.each[:] = [np.full((20, 3), 5.0) for _ in range(2)]
    runs.each[0][7], runs.each[1][2] = 1.0, 4.0
    assert pooled(runs)["lag_ms"] == 7.0


def test_beams_of_a_case() -> None:
    """Root mean square of each run, by azimuth; shown is the first run."""
    flight = known(np.zeros((3400, 2, 3)), "rolling")
    runs = figures_of(flight, steered=True)
    after, before, shown = beam_errors(flight, Array(), -60.0, 3.0)
    assert runs.figures["beam_m60_deg"] == pytest.approx(np.sqrt(np.mean(after**2, axis=1)))
    wanted = np.sqrt(np.mean(before**2))
    assert pooled(runs)["uncompensated_m60_deg"] == pytest.approx(wanted)
    assert list(runs.shown["pulses"]) == ["m60", "0", "60"]
    assert (runs.shown["pulses"]["m60"][1][1] == shown[1][1]).all()
    assert not any(name.startswith("beam") for name in figures_of(flight).figures)


def test_a_core_and_its_references() -> None:
    """The integer program and the dense filter agree within 5 %; the gyro alone drifts."""
    cases = (Case("core"), Case("dense", reference="prototype"), Case("gyro", reference="gyro"))
    core, dense, gyro = (flight_figures(fly(c, (3, 4), 3.6)) for c in cases)
    for axis in AXES:
        assert core[f"{axis}_deg"] == pytest.approx(dense[f"{axis}_deg"], rel=0.05)
    assert gyro["worst_deg"] > 0.2 and core["saturated"] == 0.0
    assert 0.0 < core["fixed_float_deg"] < 1e-3 and dense["fixed_float_deg"] == 0.0
    late = flight_figures(fly(Case("late", errors=SensorErrors(gyro_lag=5)), (3,), 3.6))
    assert late["lag_ms"] == 5.0


def test_phases_are_those_of_the_program() -> None:
    array = Array(16, 0.7)
    beams = direction([-30.0, 0.0, 50.0], 3.0)
    found = phases_of(array, np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), beams)
    wanted = 0.7 * beams[:, 1:2] * np.arange(16)
    assert np.abs((found - wanted + 0.5) % 1.0 - 0.5).max() < 1e-6


def test_a_known_attitude_leaves_no_error_of_the_beam() -> None:
    flight = known(np.zeros((3400, 1, 3)), "rolling")
    for azimuth in (-60.0, 0.0):
        after, before, shown = beam_errors(flight, Array(), azimuth, 3.0, instants=4)
        assert np.abs(after).max() < 0.05 and np.abs(before).max() > 0.5
        (whole, level), (near, steered) = shown
        assert steered.max() > 0.99 and len(near) == len(steered)
        assert whole[level.argmax()] == pytest.approx(azimuth + before[0, -1], abs=0.5)
    turned = known(np.zeros((3400, 1, 3)), "rolling")
    half = math.radians(0.5)
    c, s = math.cos(half), math.sin(half)
    w, x, y, z = np.moveaxis(turned.q, -1, 0)
    turned.q[:] = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], -1)
    off = beam_errors(turned, Array(), 0.0, 3.0, instants=4)[0]
    assert off == pytest.approx(np.full(off.shape, -1.0), abs=0.05) or off == pytest.approx(
        np.full(off.shape, 1.0), abs=0.05
    )
