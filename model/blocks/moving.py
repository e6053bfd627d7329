"""The sum of the last samples, the same code on floats and the tracer.

The states hold the samples, and one accumulator adds them: nothing drifts, and the sum is rounded
once. A running sum (plus the newest, minus the oldest sample) needs the same states, is exact only
in a word that holds the whole sum in the last bit of a sample, and never recovers from an upset. A
core has room for 128 states (`docs/engine.md`): longer windows are sums of sums, each over samples
that a counter groups.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model.declarations import State
from boresight.model.errors import require
from boresight.model.places import author_line


@dataclass(frozen=True)
class MovingSum:
    """A sum over a window.

    Parameters
    ----------
    length : int
        Samples in the window, 2 or more.
    low, high : float
        Range of a sample.

    Raises
    ------
    InputError
        The window has fewer than 2 samples.
    """

    length: int
    low: float
    high: float

    def __post_init__(self) -> None:
        require(self.length >= 2, author_line, "a window of 2 samples or more", self.length)

    def states(self, name: str, unit: str = "") -> tuple[State, ...]:
        """Earlier samples, ``NAME_1`` the newest; initially 0, or the nearest value in range."""
        first = min(max(0.0, self.low), self.high)
        return tuple(
            State(f"{name}_{k}", self.low, self.high, unit, first) for k in range(1, self.length)
        )

    def step(self, name: str, x: Any, sample: Any) -> tuple[dict[str, Any], Any]:
        """Process a sample.

        Parameters
        ----------
        name : str
            As in `states`.
        x : states
            States, the argument of the estimator's ``step``.
        sample : scalar

        Returns
        -------
        (dict, scalar)
            The next states by name, and the sum with this sample.
        """
        window = [sample, *(getattr(x, f"{name}_{k}") for k in range(1, self.length))]
        after = {f"{name}_{k}": window[k - 1] for k in range(1, self.length)}
        return after, sum(window[1:], window[0])
