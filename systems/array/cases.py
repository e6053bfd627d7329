"""Cases: the paper's two rates in every reading, and variations of the assumptions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

RATES = {"a": 0.35, "b": 36.0}  #: deg/s, by the paper's experiment.


@dataclass(frozen=True)
class Case:
    """A world and a filter; ``world`` are options of `TurningArray`, ``options`` of the filter.

    ``runs``: at most this number; ``compared``: with float64; ``calibrated``: the instruments'
    errors are in the registers.
    """

    meaning: str
    deg_s: float
    world: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    runs: int = 1000
    compared: bool = False
    hours: float = 8.0
    calibrated: bool = False


_NONE, _PLUS, _NOISE = {"index": "none"}, {"plus": True}, {"noise": 1.0}
_NODS = {"noise": 1.0, "nods_arcsec": 5.0}
_TILT = {"noise": 1.0, "tilt_deg": 5.0}
_FAULTS = {"missed": 0.1, "doubled": 0.1, "wrong": 0.05}
#: (name, meaning, world, options, runs, float64 beside) of both rates.
_BOTH: tuple[tuple[str, str, dict[str, Any], dict[str, Any], int, bool], ...] = (
    ("index", "with index", {}, {}, 1000, True),
    ("none", "no index", _NONE, {}, 1000, False),
    ("literal", "index read literally: H = [I 0]", {}, {"reading": "literal"}, 4, False),
    ("plus", "all errors plus, exact start", _PLUS, {}, 1, False),
    ("noise", "fibre-optic noise", _NOISE, {}, 2, True),
    ("tilt", "any start, fibre-optic noise", _TILT, {}, 4, True),
    ("nods", "fibre-optic noise, nods of 5 arcsec", _NODS, {}, 1, False),
)

CASES = {
    f"{key}_{name}": Case(f"{deg_s:g} deg/s, {meaning}", deg_s, world, options, runs, compared)
    for name, meaning, world, options, runs, compared in _BOTH
    for key, deg_s in RATES.items()
} | {
    "b_calibrated": Case("36 deg/s, calibrated", 36.0, runs=2, calibrated=True),
    "b_encoder": Case("36 deg/s, encoder of 18 bits instead", 36.0, {"index": "encoder"}, runs=1),
    "b_faults": Case("36 deg/s, pulses missed, doubled, wrong", 36.0, _FAULTS, runs=2),
    "other": Case("7.3 deg/s, mark at 17 deg, noise", 7.3, {"mark_deg": 17.0, **_NOISE}, runs=2),
}
