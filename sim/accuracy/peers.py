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
  attribute ``mag``, not on the argument. That direction needs a dip angle: `dip_rad`
  of the log, or what the caller knows of the place.

VQF: D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection", Information Fusion 91:187, 2023, doi 10.1016/j.inffus.2022.10.014.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, ToolMissing, require_choice
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


@dataclass(frozen=True)
class Peer:
    """One filter with one set of numbers.

    ``kernel(log, dip, *settings)`` gives attitudes (n, 4).
    """

    name: str
    summary: str
    package: str
    kernel: Callable[..., FloatArray]
    settings: tuple[object, ...]

    def run(self, log: NineAxis, dip: float | None = None) -> FloatArray:
        """Attitudes (n, 4); the dip [rad] of the place's field, by default that of the log."""
        return self.kernel(log, dip, *self.settings)


def run_peer(peer: Peer, record: Record, dip: float | None = None) -> FloatArray:
    """Attitudes (n, 4) of a published filter.

    Raises
    ------
    InputError
        The package is not installed, or cannot make anything of the log: a sample without
        specific force, for one.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return peer.run(NineAxis.of(record), dip)
    except InputError:
        raise
    except (ArithmeticError, IndexError, ValueError) as error:
        raise InputError.at(
            record.where,
            wanted=f"samples that the published filter {peer.name} takes",
            found=str(error),
            fix="leave the log or that filter out",
        ) from error


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ToolMissing(
            f"the Python package {name} is not installed: run 'pip install {name}' "
            "(compiled where there is no wheel, with python3-dev), or leave its filters out"
        ) from None


def _field(log: NineAxis) -> FloatArray:
    """Magnetometer samples (n, 3), zero where there is nothing new."""
    if not log.mag_new.any():
        raise InputError.at(
            f"log {log.name!r}",
            wanted="magnetometer samples",
            found="none",
            fix="leave this log out; without them there is no heading to compare",
        )
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


# -- vqf ----------------------------------------------------------------------------------------


def _contiguous(*arrays: FloatArray) -> list[FloatArray]:
    return [np.ascontiguousarray(a, dtype=np.float64) for a in arrays]


def _online(log: NineAxis, dip: float | None, kind: str) -> FloatArray:
    step = float(np.median(log.dt))
    # The samples of a gap are copies of the next one.
    times = np.clip(np.rint(log.dt / step), 1, _LONGEST_GAP_S / step).astype(np.int64)
    rows, last = np.repeat(np.arange(len(log)), times), np.cumsum(times) - 1
    gyr, acc = log.gyr[rows], log.acc[rows]
    package = _package("vqf")
    if not log.mag_new.any():
        out = getattr(package, kind)(step).updateBatch(*_contiguous(gyr, acc))
        return np.asarray(out["quat6D"], dtype=np.float64)[last]
    field = np.zeros_like(gyr)
    field[last] = _field(log)
    period = len(rows) / int(np.count_nonzero(log.mag_new))
    filter_ = getattr(package, kind)(step, magTs=step * period)
    out = filter_.updateBatch(*_contiguous(gyr, acc, field))
    return np.asarray(out["quat9D"], dtype=np.float64)[last]


def _vqf_offline(log: NineAxis, dip: float | None) -> FloatArray:
    _field(log)
    last = np.maximum.accumulate(np.where(log.mag_new, np.arange(len(log)), -1))
    field = log.mag[np.where(last < 0, int(np.argmax(log.mag_new)), last)]
    samples = _contiguous(log.gyr, log.acc, field)
    out = _package("vqf").offlineVQF(*samples, float(np.median(log.dt)))
    return np.asarray(out["quat9D"], dtype=np.float64)


# -- ahrs ---------------------------------------------------------------------------------------


def _stepped(
    log: NineAxis,
    start: FloatArray,
    filter_: Any,
    with_field: Callable[..., Any],
    without: Callable[..., Any],
) -> FloatArray:
    """Attitudes (n, 4) of an `ahrs` filter that is called sample by sample."""
    q = np.empty((len(log), 4))
    q[0] = start
    for k, (dt, new) in enumerate(zip(log.dt.tolist(), log.mag_new.tolist(), strict=True)):
        if k == 0:
            continue
        filter_.Dt = dt
        filter_.mag = log.mag[k] if new else None  # the EKF asks this, not its argument
        if new:
            q[k] = with_field(q[k - 1], log.gyr[k], log.acc[k], log.mag[k])
        else:
            q[k] = without(q[k - 1], log.gyr[k], log.acc[k])
    return q


def _madgwick(log: NineAxis, dip: float | None, gain: float) -> FloatArray:
    filter_ = _package("ahrs").filters.Madgwick(gain=gain)
    start = quaternion_multiply(quaternion_conjugate(_QUARTER), first_attitude(log))
    q = _stepped(log, start, filter_, filter_.updateMARG, filter_.updateIMU)
    return quaternion_multiply(_QUARTER, q)


def _mahony(log: NineAxis, dip: float | None, k_p: float, k_i: float) -> FloatArray:
    filter_ = _package("ahrs").filters.Mahony(k_P=k_p, k_I=k_i)
    return _stepped(log, first_attitude(log), filter_, filter_.updateMARG, filter_.updateIMU)


def _ekf(log: NineAxis, dip: float | None, *noises: float) -> FloatArray:
    start = first_attitude(log)
    dip = dip_rad(log) if dip is None else dip
    filter_ = _package("ahrs").filters.EKF(
        frame="NED", magnetic_ref=np.array([0.0, np.cos(dip), -np.sin(dip)]), noises=noises
    )
    return _stepped(log, start, filter_, filter_.update, filter_.update)


_TUNED, _BROAD = "(tuned on 15 BROAD trials)", "(published with BROAD)"
_BASIC, _GAINS, _NOISES = ("BasicVQF",), (0.74, 0.0012), (0.1, 1.0, 0.5)

#: Every peer by name. Gains in 1/s, noises of the EKF as variances of gyro, force and field.
PEERS: dict[str, Peer] = {
    name: Peer(name, summary, package, kernel, settings)
    for name, summary, package, kernel, settings in (
        ("vqf_offline", "VQF, offline (not causal)", "vqf", _vqf_offline, ()),
        ("vqf_online", "VQF", "vqf", _online, ("VQF",)),
        ("vqf_basic", "VQF without rest, bias and disturbance handling", "vqf", _online, _BASIC),
        ("madgwick", "Madgwick, ahrs, its gain 0.041", "ahrs", _madgwick, (0.041,)),
        ("madgwick_tuned", f"Madgwick, ahrs, gain 0.08 {_TUNED}", "ahrs", _madgwick, (0.08,)),
        ("mahony", "Mahony, ahrs, its gains 1 and 0.3", "ahrs", _mahony, (1.0, 0.3)),
        ("mahony_tuned", f"Mahony, ahrs, gains 0.74 and 0.0012 {_BROAD}", "ahrs", _mahony, _GAINS),
        ("ahrs_ekf", "EKF, ahrs, its noises 0.09, 0.25, 0.64", "ahrs", _ekf, (0.09, 0.25, 0.64)),
        ("ahrs_ekf_tuned", f"EKF, ahrs, noises 0.1, 1, 0.5 {_TUNED}", "ahrs", _ekf, _NOISES),
    )
}


def peer(name: str) -> Peer:
    """The peer called ``name``; `InputError` if there is none."""
    require_choice("peer", name, PEERS)
    return PEERS[name]


def require_peers(peers: list[Peer]) -> None:
    """Raise ToolMissing if a package of these peers is not installed."""
    for package in sorted({p.package for p in peers}):
        _package(package)
