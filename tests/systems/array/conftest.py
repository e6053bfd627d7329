"""Runs of known errors, in place of hours."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from boresight.sim.experiments.seeds import Runs
from boresight.systems.array.runs import EVERY, Turned, figures_of
from boresight.systems.array.words import WORDS

HOUR = 360_000 // EVERY


@pytest.fixture(scope="module")
def told() -> Callable[..., Turned]:
    """Two hours of pitch, roll and heading errors of size 1, 2, 3 times that asked for."""

    def of(size: float, **more: float) -> Turned:
        error = np.outer(np.where(np.arange(2 * HOUR) % 2, 1.0, -1.0), [1.0, 2.0, 3.0]) * size
        result = Turned(
            outputs={"scale_up": np.array([1e-5, 2e-5])},
            error=error,
            square={"pitch": 1e-14, "heading": 4e-14},
            largest={"pitch": 1e-7, "heading": 3e-7},
            least_eigenvalue=800.0,
            saturated=0,
            used=40,
            refused=4,
            records=10,
        )
        return replace(result, **more)

    return of


@pytest.fixture(scope="module")
def runs(told) -> Callable[..., Runs]:
    """Two runs, the second one twice as wrong."""
    return lambda size: figures_of([told(size), told(2.0 * size)])


@pytest.fixture(scope="module")
def words() -> dict[str, Runs]:
    """Strapdowns that are as wrong as their words are coarse."""
    return {
        f"{key}_{w}": Runs(
            {"carried_rms": np.array([2.0**-w]), "plain_rms": np.array([2.0 ** (4 - w)])}
        )
        for w in WORDS
        for key in "ab"
    }
