"""Pulses of the mark: when they come, what they tell, and faults by their share."""

import math

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.worlds.inertial.turntable import STEP, Mark, Pulses, pulses

DT, TURN = 0.01, 2.0 * math.pi
ARCSEC = math.radians(1.0) / 3600.0


def drawn(mark: Mark, deg_s: float = 37.3, heading: float = 1.0, hours: float = 2.0) -> Pulses:
    samples = round(hours * 3600.0 / DT)
    return pulses(mark, heading, math.radians(deg_s), samples, DT, np.random.default_rng(5))


def off(found: Pulses, deg_s: float = 37.3, heading: float = 1.0) -> np.ndarray:
    """Where the table is at each pulse less what the pulse tells [arcsec]."""
    passed = heading + math.radians(deg_s) * DT * (found.sample + found.share)
    return ((passed - found.azimuth + math.pi) % TURN - math.pi) / ARCSEC


def test_a_pulse_comes_where_the_mark_is() -> None:
    """Once a turn, as far off as a step of 18 bits, and timed."""
    found = drawn(Mark(at_deg=200.0))
    turns = 37.3 * 7200.0 / 360.0
    assert abs(len(found.sample) - turns) <= 1.0
    assert off(found).std() == pytest.approx(4.94 / math.sqrt(12.0), rel=0.06)
    assert abs(off(found).mean()) < 0.2
    assert (found.azimuth == math.radians(200.0)).all()
    assert (found.share >= 0.0).all() and (found.share <= 1.0).all()
    assert np.ptp(found.share) > 0.9 and (np.diff(found.sample) > 0).all()


def test_an_encoder_is_read_with_the_samples() -> None:
    """At their ends, in steps: the error is that of rounding, the angle less than a sample on."""
    found = drawn(Mark(at_deg=200.0, index="encoder"))
    assert found.share == pytest.approx(np.ones(len(found.share)))
    assert np.abs(off(found)).max() <= 0.5 * STEP / ARCSEC + 1e-3
    assert off(found).std() == pytest.approx(STEP / ARCSEC / math.sqrt(12.0), rel=0.06)
    steps = (found.azimuth - math.radians(200.0)) / STEP
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
    assert steps.min() >= 0.0 and steps.max() <= math.radians(37.3) * DT / STEP + 1.0
    assert pytest.approx(4.944, abs=1e-3) == STEP / ARCSEC


def test_the_first_pulse_is_the_first_time_that_the_mark_passes() -> None:
    """A mark just behind is a turn away; one just ahead comes at once; too short, none comes."""
    mark, rate = Mark(at_deg=math.degrees(1.0) + 0.01, index="encoder"), math.radians(36.0)
    rng = np.random.default_rng(1)
    assert pulses(mark, 1.0, rate, 2000, DT, rng).sample.tolist() == [0, 1000]
    assert pulses(mark, 1.0 + 4e-4, rate, 2000, DT, rng).sample.tolist() == [999, 1999]
    assert len(pulses(mark, 1.0 + 4e-4, rate, 900, DT, rng).sample) == 0


def test_none() -> None:
    assert len(drawn(Mark(index="none", wrong=1.0, doubled=1.0)).sample) == 0


def test_faults_by_their_shares() -> None:
    whole = drawn(Mark(at_deg=200.0), hours=8.0)
    n = len(whole.sample)
    fewer = drawn(Mark(at_deg=200.0, missed=0.3), hours=8.0)
    assert len(fewer.sample) / n == pytest.approx(0.7, abs=0.03)
    assert set(fewer.sample) < set(whole.sample)
    twice = drawn(Mark(at_deg=200.0, doubled=0.2), hours=8.0)
    assert len(twice.sample) / n == pytest.approx(1.2, abs=0.03)
    late = np.diff(twice.sample)
    assert set(whole.sample) < set(twice.sample) and set(late[late < 100]) == {1, 2, 3, 4, 5}
    both = drawn(Mark(at_deg=200.0, missed=0.3, doubled=0.2), hours=8.0)
    assert len(both.sample) / n == pytest.approx(0.7 * 1.2, abs=0.04)
    astray = drawn(Mark(at_deg=200.0, wrong=0.25), hours=8.0)
    assert len(astray.sample) / n == pytest.approx(1.25, abs=0.03)
    wrong = np.abs(off(astray)) > 60.0
    assert wrong.sum() / n == pytest.approx(0.25, abs=0.03)
    assert np.histogram(off(astray)[wrong], bins=4, range=(-648e3, 648e3))[0].min() > 0.15 * (
        wrong.sum()
    )


@pytest.mark.parametrize(
    "options, message",
    [
        ({"index": "laser"}, "index: wanted one of hall, encoder, none, found 'laser'"),
        ({"missed": 1.1}, "missed: wanted a share, 0 to 1, found 1.1"),
        ({"doubled": -0.1}, "doubled: wanted a share"),
        ({"wrong": 2.0}, "wrong: wanted a share"),
    ],
)
def test_what_is_refused(options, message: str) -> None:
    with pytest.raises(InputError, match=f"^mark, {message}"):
        Mark(**options)
