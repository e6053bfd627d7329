"""The two tests of Ma Long et al. (2014) as logs: motions, and errors of the sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from boresight.sim.attitude.ma2014.devices import accelerometer, gyro, magnetometer
from boresight.sim.attitude.ma2014.motion import StackedMotion, Swing
from boresight.sim.attitude.ma2014.paper import TABLE_1, TABLE_2
from boresight.sim.attitude.ma2014.recording import Sensors, record
from boresight.sim.attitude.worlds.triad import Triad, misalignment, soft_iron
from boresight.sim.records.record import Record

__all__ = [
    "AVERAGED",
    "CASES",
    "Case",
    "E1",
    "E2",
    "FIELD_UT",
    "LEAD",
    "LOOP_HZ",
    "make_log",
    "noise_free_log",
]

LOOP_HZ = 8.0
#: Accelerometer samples averaged into one of the loop, 100 Hz over 8 Hz.
AVERAGED = 12.5
#: Tianjin: (-3.45, 27.90, -46.20) uT east, north, up, seen from magnetic north.
FIELD_UT = (0.0, math.hypot(-3.45, 27.90), -46.20)
#: Samples at rest before t = 0, 3 s, in which the filters align. They are not scored.
LEAD = 24


def _table_1() -> StackedMotion:
    swings, angle = [], [0.0, 0.0, 0.0]
    for row in TABLE_1:
        axis = "xyz".index(row["stage"])
        end = float(row["end_deg"][axis])
        outward = angle[axis] == 0.0  # from the middle to the end of the swing, or back
        swings.append(
            Swing(
                axis,
                math.radians(end if outward else angle[axis]),
                row["period_s"],
                row["periods"],
                phase=0.0 if outward else math.pi / 2.0,
            )
        )
        angle[axis] = end
    return StackedMotion(tuple(swings))


#: Section 1.3: heading, 20 deg, 6 s, 90 periods.
E1 = StackedMotion((Swing(2, math.radians(20.0), 6.0, 90.0),))
#: Section 3.2: Table 1.
E2 = _table_1()


@dataclass(frozen=True)
class Case:
    """Errors of the sensors besides the noise of Table 2.

    Parameters
    ----------
    misalignment_deg : float
        Standard deviation of the gyro's turn about each axis, drawn anew in every run.
    ellipse : float
        Soft iron of a fixed form: the magnetometer's x too large by this fraction, its y too small.
    soft_iron_sd : float
        Soft iron drawn anew in every run: standard deviation of each element of the matrix.
    bias_removed : bool
        Whether the gyro's bias (Table 2) has been taken off.
    acc_latency_s : float
        Age of the accelerometer's average.
    """

    title: str
    misalignment_deg: float = 0.0
    ellipse: float = 0.0
    soft_iron_sd: float = 0.0
    bias_removed: bool = True
    acc_latency_s: float = 0.0


_C = Case("case C: noise, gyro misaligned, soft iron", misalignment_deg=1.0, ellipse=0.01)

CASES = {
    "noise": Case("noise of Table 2 alone"),
    "misalignment": Case(
        "noise, and the gyro misaligned by 1 deg (sd, each axis)", misalignment_deg=1.0
    ),
    "soft_iron": Case("noise, and soft iron: x 1 % too large, y 1 % too small", ellipse=0.01),
    "C": _C,
    "random_iron": replace(
        _C,
        title="case C with random soft iron instead, 1 % (sd, each element)",
        ellipse=0.0,
        soft_iron_sd=0.01,
    ),
    "latency": replace(
        _C,
        title="case C, the delay of the accelerometer's average left in",
        acc_latency_s=0.5 / LOOP_HZ,
    ),
    "bias": replace(_C, title="case C, the gyro bias of Table 2 left in", bias_removed=False),
}


def make_log(motion: StackedMotion, case: Case, seed: int) -> Record:
    """The log of a motion at the loop's rate, `LEAD` samples at rest first."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, 2014]))
    turn = misalignment(rng, math.radians(case.misalignment_deg))
    ellipse = np.diag([1.0 + case.ellipse, 1.0 - case.ellipse, 1.0])
    iron = soft_iron(rng, case.soft_iron_sd) @ ellipse
    sensors = Sensors(
        gyro().with_errors(matrix=turn),
        accelerometer().with_errors(averaged=AVERAGED, latency_s=case.acc_latency_s),
        magnetometer().with_errors(matrix=iron),
        gyro_bias=TABLE_2.gyro_bias if case.bias_removed else (0.0, 0.0, 0.0),
    )
    return record(
        motion, sensors, rate_hz=LOOP_HZ, seed=seed, field_ut=FIELD_UT, lead=LEAD, name="ma2014"
    )


def noise_free_log(motion: StackedMotion, rate_hz: float) -> Record:
    """The same with ideal sensors at another rate."""
    ideal = Triad(rate_hz, 0.0, 1e9)
    return record(
        motion,
        Sensors(ideal, ideal, ideal),
        rate_hz=rate_hz,
        seed=0,
        field_ut=FIELD_UT,
        lead=LEAD,
        name="ma2014 noise-free",
    )
