"""How a log becomes the raw counts that the sensors of a board would have sent, and back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.front.compass_field import TENTH_HT
from boresight.model.front.field import FIELD_SCALE
from boresight.model.front.inertial import ACC_SCALE, GYRO_SCALE, STAMP_BITS
from boresight.model.front.sensed import ACC_COUNTS, GYRO_COUNTS
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.attitude.log import Log
from boresight.sim.attitude.rotation import quaternion_to_euler
from boresight.sim.board.chain import COUNTS, HEADING, NO_LINE, Chain, Samples

__all__ = ["quantise", "words_as_log"]


def quantise(
    log: Log,
    *,
    clock_hz: float = 100e6,
    kind: int = COUNTS,
    line_hz: float = 8.0,
    gyro_scale: float = GYRO_SCALE,
    acc_scale: float = ACC_SCALE,
    field_scale: float = FIELD_SCALE,
    number: int = 0,
) -> Samples:
    """A log as what an ADIS16385 and an HMR3300 would have sent.

    Sensor axes are body axes. Rates and forces beyond the sensors' full scale are clamped there.

    Parameters
    ----------
    clock_hz : float
        Clock that the stamps count.
    kind : int
        Lines of the compass: `NO_LINE`, `COUNTS` (of the log's field) or `HEADING` (of its
        reference attitude).
    line_hz : float
        Most lines in a second.
    gyro_scale, acc_scale, field_scale : float
        rad/s, m/s^2 and uT per count.
    number : int
        Filter.

    Raises
    ------
    InputError
        Headings are wanted of a log without reference attitude.
    """
    if kind == HEADING and log.q is None:
        raise InputError.at(
            f"log {log.name!r}",
            wanted="a reference attitude, to read headings",
            found="none",
            fix="use a log with qw,qx,qy,qz, or counts",
        )
    n = len(log)
    stamp = np.rint((log.t - log.t[0]) * clock_hz).astype(np.int64)
    counts = np.column_stack(
        [_counts(log.gyr, gyro_scale, GYRO_COUNTS), _counts(log.acc, acc_scale, ACC_COUNTS)]
    )
    here = np.isfinite(log.q).all(axis=1) if kind == HEADING and log.q is not None else log.mag_new
    line = np.full(n, NO_LINE)
    due = log.t[0]
    for k in np.flatnonzero(here) if kind != NO_LINE else ():
        if log.t[k] >= due:
            line[k] = kind
            due = max(due + 1.0 / line_hz, log.t[k])
    values = np.zeros((n, 3), dtype=np.int64)
    rows = line != NO_LINE
    if kind == COUNTS:
        values[rows] = _counts(log.mag[rows], field_scale, 32767)
    elif kind == HEADING and log.q is not None:
        pitch, roll, heading = quaternion_to_euler(log.q[rows]).T / np.pi
        angles = np.rint(np.stack([-heading, pitch, roll], axis=1) / TENTH_HT).astype(np.int64)
        angles[:, 0] %= 3600
        values[rows] = angles
    restart = np.zeros(n, dtype=np.bool_)
    restart[0] = True
    return Samples(stamp % (1 << STAMP_BITS), counts, line, values, restart, np.full(n, number))


def _counts(value: npt.NDArray[np.float64], scale: float, limit: int) -> IntArray:
    return np.clip(np.rint(value / scale), -limit, limit).astype(np.int64)


def words_as_log(program: Program, chain: Chain, name: str = "words") -> Log:
    """The records of a chain as a log in SI units: `sim.attitude.feed` gives the words back.

    Parameters
    ----------
    program : Program
        A filter, for the formats of its inputs.
    """
    real = {
        program.values[n].name: program.format(n).real(chain.records[:, k])
        for k, n in enumerate(program.streamed)
    }
    steps = np.where(chain.restart, 2.0**-10, real["dt"])

    def triple(letter: str) -> npt.NDArray[np.float64]:
        return np.stack([real[f"{letter}{a}"] for a in "xyz"], axis=1)

    field = triple("m")
    return Log(
        name=name,
        t=np.cumsum(steps),
        gyr=triple("g"),
        acc=triple("a"),
        mag=field,
        mag_new=(field != 0.0).any(axis=1),
        restart=chain.restart,
    )
