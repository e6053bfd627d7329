"""Interface of a Kalman filter for the derivation: its layout and the author's methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from boresight.model import declarations
from boresight.model.declarations import Input, Output, Param
from boresight.model.kalman.declared import Attitude, Measurement, State

__all__ = ["Filter"]


class Filter(Protocol):
    """A `Kalman`.

    Attributes
    ----------
    estimated : tuple of State or Attitude
        As declared.
    errors, places : list of str
        Of each error state, a row of P: its name, and where it is declared.
    largest_sd : list of float
        Its largest standard deviation.
    variance_limits, noise_floor : list of float
        Variances: beyond the first it grows no more; the second is added in every update.
    groups : dict of str to tuple of str
        Names of the error states that the name of a state or vector stands for.
    covariance_states : dict of str to (int, int)
        States that are elements of P, i <= j.
    dither : bool
        Whether the rounding of the predicted P is random; ``memory`` has a word for it then.
    """

    name: str
    inputs: tuple[Input, ...]
    params: tuple[Param, ...]
    states: tuple[Any, ...]
    outputs: tuple[Output, ...]
    memory: tuple[declarations.State, ...]
    prior: bool
    estimated: tuple[State | Attitude, ...]
    errors: list[str]
    places: list[str]
    largest_sd: list[float]
    variance_limits: list[float]
    noise_floor: list[float]
    groups: dict[str, tuple[str, ...]]
    covariance_states: dict[str, tuple[int, int]]
    dither: bool
    rates_hz: Mapping[str, float]

    @property
    def f(self) -> Callable[[Any, Any, Any], Mapping[str, Any]]:
        """See `Kalman`, as for the other methods."""
        ...

    @property
    def noise(self) -> Callable[[Any, Any, Any], Mapping[Any, Any]]: ...

    @property
    def measure(self) -> Callable[[Any, Any, Any], Sequence[Measurement]]: ...

    @property
    def shown(self) -> Callable[[Any, Any, Any], Mapping[str, Any]]: ...

    def param_values(self, given: Mapping[str, float] | None = None) -> dict[str, float]:
        """Defaults with ``given`` on top."""
        ...
