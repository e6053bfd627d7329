"""Cases: the filter as corrected and as printed, other sensors, other decks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from boresight.systems.mls.deck import SensorErrors


@dataclass(frozen=True)
class Case:
    """One configuration; ``full``: with all runs; ``reference``: "prototype" or "gyro", no core.

    ``steered``: the beam is looked at too.
    """

    meaning: str
    options: Mapping[str, str | int] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    errors: SensorErrors = SensorErrors()
    motion: str = "table"
    reference: str = ""
    full: bool = False
    steered: bool = False


_SPREAD = SensorErrors(gyro_bias=(0.0, 0.0, 0.0), bias_spread=0.2)
_FOLLOWS = {"gyro_sd": 0.2}  # rad/s: the remainder of a bias of 0.2 deg/s is small
_ROLLING: dict[str, Any] = {"motion": "rolling", "steered": True}
_FREE = {"norm": "free", "innovation": "printed"}

CASES = {
    "corrected": Case("as corrected, Picard of third order", full=True),
    "prototype": Case("dense float64, begun as the core", reference="prototype", full=True),
    "picard_4": Case("Picard of fourth order, as (21)", {"picard": 4}),
    "gyro_only": Case("gyro alone", reference="gyro", full=True),
    "lag_5ms": Case("gyro 5 ms late", errors=SensorErrors(gyro_lag=5)),
    "process_18": Case("as printed (18), q' = -w q/2", {"process": "printed"}),
    "measurement_24": Case("as printed (24), h = C V", {"measurement": "printed"}),
    "innovation_28": Case("as printed (28), z - H q", {"innovation": "printed"}, full=True),
    "norm_free": Case("q never set to norm one", {"norm": "free"}),
    "norm_free_28": Case("(28), and q never set to norm one", _FREE),
    "bias": Case("gyro biases drawn, 0.2 deg/s each axis", errors=_SPREAD),
    "bias_follows": Case("gyro biases drawn, gyro_sd 11 deg/s", params=_FOLLOWS, errors=_SPREAD),
    "rolling": Case("ship turning by up to 10 deg about each axis", full=True, **_ROLLING),
    "rolling_bias": Case("ship turning, biases drawn, 11 deg/s", {}, _FOLLOWS, _SPREAD, **_ROLLING),
    **{
        f"sea_{n}": Case(f"carrier in sea state {n}", motion=f"sea_{n}", steered=n > 4)
        for n in (4, 5, 6)
    },
}
