"""Published attitude filters, run as their own packages run them, on the same logs.

Each gives attitudes b to n (ENU) like ours. What their packages leave to the user:

* `vqf` works in ENU. Its filters want one rate; a log with other steps gets the median step, and
  gaps are filled with the sample that ends them. Without any field it is its six-axis form. Where
  the magnetometer has nothing new they are fed the zero vector, which they skip, and are told the
  mean step of the magnetometer; the offline filter, which knows one rate only, gets the last
  sample again.
* `ahrs` filters are stepped with the log's own time steps and start from the full attitude of the
  first force and field; the package's own start formula is right only near level and north. Its
  `Madgwick` takes x as north (ours = a quarter turn about the vertical times its), its `Mahony` y
  as north. Its `EKF` calls "NED" what has z up when fed with specific force; with the field
  direction given as an array in ENU it works in ENU, and whether it uses the field depends on its
  attribute ``mag``, not on the argument. That direction needs a dip angle: `dip_rad`.

VQF: D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection", Information Fusion 91:187, 2023, doi 10.1016/j.inffus.2022.10.014.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
)

#: ENU out of axes with x to the north and y to the west: a quarter turn about the vertical.
_QUARTER = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
#: Longest gap [s] that is filled.
_LONGEST_GAP_S = 1.0


def run_peer(name: str, record: Record) -> FloatArray:
    """Attitudes (n, 4) of a published filter, one of `PEERS`.

    Raises
    ------
    InputError
        The filter cannot make anything of the log: a sample without specific force, for one.
    ToolMissing
        Its package is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return PEERS[name][1](NineAxis.of(record))
    except InputError:
        raise
    except (ArithmeticError, IndexError, ValueError) as error:
        raise InputError.at(
            record.where,
            wanted=f"samples that the published filter {name} takes",
            found=str(error),
            fix="leave the log or that filter out",
        ) from error


def _field(log: NineAxis) -> FloatArray:
    """Magnetometer samples (n, 3), zero where there is nothing new."""
    if not log.mag_new.any():
        fix = "leave this log out; without them there is no heading to compare"
        where = f"log {log.name!r}"
        raise InputError.at(where, wanted="magnetometer samples", found="none", fix=fix)
    return np.where(log.mag_new[:, None], log.mag, 0.0)


def first_attitude(log: NineAxis) -> FloatArray:
    """Attitude (4,) b to n of the first specific force and the first field."""
    field = _field(log)[int(np.argmax(log.mag_new))]
    up = log.acc[0] / np.linalg.norm(log.acc[0])
    east = np.cross(field, up)
    east /= np.linalg.norm(east)
    return matrix_to_quaternion(np.stack([east, np.cross(up, east), up]))


def dip_rad(log: NineAxis) -> float:
    """Dip of the field [rad].

    From the field in the reference's axes, component by component the median; without reference,
    the median angle below the plane across the specific force.
    """
    rows = log.mag_new if log.q is None else log.mag_new & ~np.isnan(log.q).any(axis=1)
    if log.q is not None and rows.any():
        east, north, up = np.median(rotate(log.q[rows], log.mag[rows]), axis=0)
        return float(np.arctan2(-up, np.hypot(east, north)))
    acc, mag = log.acc[log.mag_new], log.mag[log.mag_new]
    down = -np.sum(acc * mag, axis=1)
    size = np.linalg.norm(acc, axis=1) * np.linalg.norm(mag, axis=1)
    return float(np.arcsin(np.median(down[size > 0] / size[size > 0])))


def _online(kind: str, log: NineAxis) -> FloatArray:
    """A filter of `vqf` that is called sample by sample."""
    step = float(np.median(log.dt))
    # The samples of a gap are copies of the next one.
    times = np.clip(np.rint(log.dt / step), 1, _LONGEST_GAP_S / step).astype(np.int64)
    rows, last = np.repeat(np.arange(len(log)), times), np.cumsum(times) - 1
    samples, settings = [log.gyr[rows], log.acc[rows]], {}
    if has_field := log.mag_new.any():
        samples.append(np.zeros_like(samples[0]))
        samples[-1][last] = _field(log)
        settings["magTs"] = step * (len(rows) / int(np.count_nonzero(log.mag_new)))
    out = getattr(optional("vqf"), kind)(step, **settings).updateBatch(*samples)
    return np.asarray(out["quat9D" if has_field else "quat6D"], dtype=np.float64)[last]


def _vqf_offline(log: NineAxis) -> FloatArray:
    _field(log)
    last = np.maximum.accumulate(np.where(log.mag_new, np.arange(len(log)), -1))
    field = log.mag[np.where(last < 0, int(np.argmax(log.mag_new)), last)]
    samples = map(np.ascontiguousarray, (log.gyr, log.acc, field))
    out = optional("vqf").offlineVQF(*samples, float(np.median(log.dt)))
    return np.asarray(out["quat9D"], dtype=np.float64)


def _ahrs(kind: str, log: NineAxis, **settings: object) -> FloatArray:
    """A filter of `ahrs`, which is called sample by sample."""
    q = np.empty((len(log), 4))
    q[0] = first_attitude(log)
    if kind == "Madgwick":
        q[0] = quaternion_multiply(quaternion_conjugate(_QUARTER), q[0])
    if kind == "EKF":
        dip = dip_rad(log)
        direction = np.array([0.0, np.cos(dip), -np.sin(dip)])
        settings |= {"frame": "NED", "magnetic_ref": direction}
    filter_ = getattr(optional("ahrs.filters"), kind)(**settings)
    with_field, without = (
        getattr(filter_, "update" if kind == "EKF" else name)
        for name in ("updateMARG", "updateIMU")
    )
    for k, (dt, new) in enumerate(zip(log.dt[1:].tolist(), log.mag_new[1:], strict=True), 1):
        filter_.Dt = dt
        filter_.mag = log.mag[k] if new else None  # the EKF asks this, not its argument
        samples = (q[k - 1], log.gyr[k], log.acc[k])
        q[k] = with_field(*samples, log.mag[k]) if new else without(*samples)
    return quaternion_multiply(_QUARTER, q) if kind == "Madgwick" else q


#: Package and function of every filter. Gains in 1/s, noises of the EKF as variances of gyro, force
#: and field: those of the package, and tuned ones (Mahony's are published with BROAD, the others
#: are from 15 of its trials).
PEERS: dict[str, tuple[str, Callable[[NineAxis], FloatArray]]] = {
    "vqf_offline": ("vqf", _vqf_offline),
    "vqf_online": ("vqf", partial(_online, "VQF")),
    "vqf_basic": ("vqf", partial(_online, "BasicVQF")),
    "madgwick": ("ahrs", partial(_ahrs, "Madgwick", gain=0.041)),
    "madgwick_tuned": ("ahrs", partial(_ahrs, "Madgwick", gain=0.08)),
    "mahony": ("ahrs", partial(_ahrs, "Mahony", k_P=1.0, k_I=0.3)),
    "mahony_tuned": ("ahrs", partial(_ahrs, "Mahony", k_P=0.74, k_I=0.0012)),
    "ahrs_ekf": ("ahrs", partial(_ahrs, "EKF", noises=(0.09, 0.25, 0.64))),
    "ahrs_ekf_tuned": ("ahrs", partial(_ahrs, "EKF", noises=(0.1, 1.0, 0.5))),
}


def require_peers(names: list[str]) -> None:
    """Raise ToolMissing if a package of these filters is not installed."""
    for package in sorted({PEERS[name][0] for name in names}):
        optional(package)
