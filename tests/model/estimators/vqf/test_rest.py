"""When the body rests, and when it does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.model.estimators.vqf.interface import interface_of
from boresight.model.estimators.vqf.rest import rest_of
from boresight.model.estimators.vqf.settings import DEGREE, Settings

SETTINGS = Settings(50.0, 50.0)
PARAMS = SimpleNamespace(**{p.name: p.default for p in interface_of(SETTINGS)[1]})


def still(gyro: Any, force: Any) -> tuple[list[float], list[Any]]:
    """Samples counted after each one, and the mean rates."""
    x = {s.name: s.initial for s in interface_of(SETTINGS)[2]}
    counts, rates = [], []
    for n, (g, f) in enumerate(zip(gyro, force, strict=True)):
        u = dict(zip(("gx", "gy", "gz", "ax", "ay", "az"), (*g, *f), strict=True))
        x["count"] = min(float(n), 512.0)
        count, rate, after = rest_of(
            SimpleNamespace(**x), SimpleNamespace(**u), PARAMS, 1.0 / (n + 1.0), SETTINGS
        )
        x |= after | {"still": count}
        counts.append(float(count))
        rates.append([float(c) for c in rate])
    return counts, rates


def steady(n: int, rate: Any = (0.0, 0.0, 0.0)) -> tuple[Any, Any]:
    return np.tile(np.array(rate) * DEGREE, (n, 1)), np.tile([0.0, 0.0, 9.81], (n, 1))


def test_samples_count_from_the_first_and_stop_at_a_limit() -> None:
    counts, rates = still(*steady(200, (0.5, -1.9, 1.0)))
    assert counts[:100] == list(range(1, 101)) and counts[-1] == 128.0
    assert rates[-1] == pytest.approx(np.array([0.5, -1.9, 1.0]) * DEGREE)
    assert SETTINGS.rest_samples == 75


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
