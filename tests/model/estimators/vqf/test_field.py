"""The magnetometer's part by itself: the heading's gain, disturbances, a new reference."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.estimators.vqf.field import heading_of
from boresight.model.estimators.vqf.interface import interface_of
from boresight.model.estimators.vqf.settings import Settings

SETTINGS = Settings(20.0, 20.0)
PARAMS = SimpleNamespace(**{p.name: p.default for p in interface_of(SETTINGS)[1]})
LEVEL = np.eye(3).tolist()
EARTH = np.array([0.0, 20.0, -40.0])


class Field:
    """Samples one after the other; the body is level and points to where ``delta`` says."""

    def __init__(self) -> None:
        self.x = {s.name: s.initial for s in interface_of(SETTINGS)[2]}

    def __call__(self, field: Any, turning: bool = True, restart: bool = False) -> Any:
        x = SimpleNamespace(**self.x)
        found = heading_of(x, restart, LEVEL, tuple(field), turning, PARAMS, SETTINGS)
        self.x |= {name: float(value) for name, value in found.states.items()}
        return found


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


def test_the_first_samples_are_averaged() -> None:
    field = Field()
    for n, angle in enumerate((0.3, 0.1, 0.2, -0.2), 1):
        found = field(turned(angle))
        assert float(found.delta) == pytest.approx(np.mean((0.3, 0.1, 0.2, -0.2)[:n]))
    assert not found.unknown and found.disturbed


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
        found = field(other, turning=False)
    assert found.disturbed == odd
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


def test_without_a_sample_nothing_changes() -> None:
    field = Field()
    accepted(field)
    held = dict(field.x)
    found = field([0.0, 0.05, -0.05])
    assert found.missing and not found.disturbed and field.x == held


def test_a_new_start_forgets() -> None:
    field = Field()
    accepted(field)
    field(EARTH, restart=True)
    fresh = {s.name: s.initial for s in interface_of(SETTINGS)[2]}
    names = ("delta", "ref_norm", "new_norm", "calm", "patience", "mag_count")
    assert {n: field.x[n] for n in names} == {n: fresh[n] for n in names}
    assert accepted(field) == 1 + SETTINGS.candidate_samples[0]
