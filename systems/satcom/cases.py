"""Cases of the claims, and variations of their assumptions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from boresight.model.declarations import GRAVITY
from boresight.systems.satcom.dish import Link
from boresight.systems.satcom.drive import drive
from boresight.systems.satcom.world import SensorErrors, Vehicles


@dataclass(frozen=True)
class Case:
    """A drive, a world and a filter, whose defaults are the specification's.

    ``params`` and ``options`` are those of `Satcom`, ``world`` those of `Vehicles`.
    """

    meaning: str
    drive: str = "specification"
    rate_hz: float = 50.0
    params: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    world: Mapping[str, Any] = field(default_factory=dict)

    def fleet(self, seeds: range) -> Vehicles:
        """Its vehicles, one for each seed."""
        return Vehicles(drive(self.drive, self.rate_hz), seeds, **self.world)


_DEG = 0.017453292519943295
_PI = {"beam": "heading_pi"}
#: The heading measured by each tracking sample alone, with the receiver's noise; R as it is.
_DECLARED = {
    **{"cutoff": 0.625, "damping": 4.0, "heading_sd": 0.2 * _DEG},
    **{"roll_sd": 0.05 / GRAVITY, "pitch_sd": 0.05 / GRAVITY},
}

CASES = {
    "adaptive": Case("adaptive R, tracking at 5 Hz"),
    "fixed_r": Case("R fixed", params={"adapt": 1.0}),
    "no_tracking": Case("receiver off", world={"tracking_hz": 0.0}),
    "tracking_1hz": Case("tracking at 1 Hz", world={"tracking_hz": 1.0}),
    "tracking_20hz": Case("tracking at 20 Hz", world={"tracking_hz": 20.0}),
    "pi_alone": Case("antenna on the heading of the PI loop alone", world=_PI),
    "pi_slow": Case("PI loop alone, cut-off 0.1 rad/s", params={"cutoff": 0.1}, world=_PI),
    "pi_fast": Case("PI loop alone, cut-off 2 rad/s", params={"cutoff": 2.0}, world=_PI),
    "pi_1hz": Case("PI loop alone, tracking at 1 Hz", world={**_PI, "tracking_hz": 1.0}),
    "printed_roll": Case("roll as printed, -atan(fy/fz)", options={"roll": "printed"}),
    "printed_detector": Case("detector as printed, a_z - g", options={"detector": "printed"}),
    "declared": Case("each tracking sample a heading, R as the noise is", params=_DECLARED),
    "city": Case("half an hour: tunnels, bridges, roundabouts, bumps", drive="city"),
}


def _place(latitude: float, east: float) -> dict[str, Any]:
    return {"place": (latitude, 110.5 - east, 110.5)}


def _errors(**errors: Any) -> dict[str, Any]:
    return {"errors": SensorErrors(**errors)}


#: Cases with the defaults of the filter, unless it says otherwise.
WHAT_IF = {
    "start_left": Case("heading 2.5 deg off at the start, to the left", world={"start_deg": -2.5}),
    "bias_1": Case("gyro bias 1, -1, 1 deg/s", world=_errors(gyro_bias=(1.0, -1.0, 1.0))),
    "walk": Case("gyro bias that walks, 0.002 deg/s/sqrt(s)", world=_errors(gyro_walk=0.002)),
    "noise_3": Case("three times the noise", world=_errors(gyro_noise=0.15, acc_noise=0.15)),
    "acc_bias": Case("accelerometer off by 0.18 deg", world=_errors(acc_bias=(0.03, -0.03, 0.03))),
    "weak": Case("beacon 6 dB weaker", world={"link": Link(eirp_dbw=0.0)}),
    "rough": Case("12 deg of side slope, twice the road, turns to 36 deg/s", drive="rough"),
    "equator": Case("satellite at 85 deg of elevation", world=_place(4.0, 2.0)),
    "north": Case("65 deg north, satellite at 16 deg", world=_place(65.0, 5.0)),
    "east": Case("satellite 50 deg east", world=_place(20.0, 50.0)),
    "west": Case("satellite 50 deg west, 33 south", world=_place(-33.0, -50.0)),
    "hz_100": Case("records at 100 Hz, the same noise a sample", rate_hz=100.0),
    "hz_200": Case("records at 200 Hz, the same noise a sample", rate_hz=200.0),
}
