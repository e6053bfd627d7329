"""Sensor logs: the record that every run is fed with.

A log file is either CSV with the header ``t,gx,gy,gz,ax,ay,az,mx,my,mz`` and optionally
``qw,qx,qy,qz`` (columns in any order, comment lines starting with ``#`` above the header), or
``.npz`` with the arrays ``t, gyr, acc, mag`` and optionally ``q, mov, restart, fs``. Units and
frames are those of `Log`. A magnetometer triple that is empty (CSV) or NaN (npz) says that the
sensor had nothing new in that row; an empty or NaN quaternion says that the reference has a gap
there.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.disk.output import OutputFile
from boresight.model.errors import InputError
from boresight.sim.attitude.log_checks import check_samples, clean_arrays, clean_rate, index_place
from boresight.sim.attitude.log_csv import format_csv, parse_csv
from boresight.sim.attitude.log_npz import format_npz, parse_npz
from boresight.sim.records.reading import read_bytes, reason

__all__ = ["RESTART_S", "Log", "log_content", "read_log", "write_log"]

RESTART_S = -0.25  #: s, a time step that restarts every filter.

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Log:
    """What the sensors said, sample by sample, and perhaps what the attitude was.

    Arrays are copied as float64 (bool for the flags) and checked; n is the number of samples.

    Parameters
    ----------
    name : str
        Short name for reports; `read_log` takes the file name without suffix.
    t : (n,) array
        Time [s], strictly increasing.
    gyr : (n, 3) array
        Body rate [rad/s] in b. Sample k is the mean rate of the step that ends at ``t[k]``.
    acc : (n, 3) array
        Specific force [m/s^2] in b: +g on the axis that points up at rest.
    mag : (n, 3) array
        Magnetic flux density [uT] in b. Rows that are not new become NaN.
    mag_new : (n,) array of bool
        Whether the magnetometer delivered a new sample in that row.
    q : (n, 4) array, optional
        Reference attitude, Hamilton, scalar first, b to n (ENU). NaN rows: reference missing.
    mov : (n,) array of bool, optional
        Samples that count when errors are averaged.
    restart : (n,) array of bool, optional
        Samples at which a filter begins anew: their time step is `RESTART_S`.
    fs : float, optional
        Sampling rate [Hz] of a log with a uniform step; without it, `t` gives the steps.

    Raises
    ------
    InputError
        If a shape is wrong, a value is not finite, the time does not increase, a magnetometer or
        quaternion row is NaN in part, or a quaternion is not of norm one.
    """

    name: str
    t: FloatArray
    gyr: FloatArray
    acc: FloatArray
    mag: FloatArray
    mag_new: BoolArray
    q: FloatArray | None = None
    mov: BoolArray | None = None
    restart: BoolArray | None = None
    fs: float | None = None

    def __post_init__(self) -> None:
        where = f"log {self.name!r}"
        place = index_place(where)
        keys = ("t", "gyr", "acc", "mag", "mag_new", "q", "mov", "restart")
        clean = clean_arrays(where, {key: getattr(self, key) for key in keys})
        clean["mag"][~clean["mag_new"]] = np.nan
        check_samples(clean, place)
        lost = clean["mag_new"] & np.isnan(clean["mag"]).all(axis=1)
        if lost.any():
            raise InputError.at(
                place(int(np.argmax(lost)), "mag", 0),
                wanted="a finite number (uT), as mag_new is true",
                found="no value",
                fix="clear mag_new there",
            )
        for key, value in clean.items():
            object.__setattr__(self, key, value)
        if self.fs is not None:
            object.__setattr__(self, "fs", clean_rate(where, self.fs))

    def __len__(self) -> int:
        """Count the samples."""
        return len(self.t)

    @property
    def dt(self) -> FloatArray:
        """Time step that ends at each sample, [s], (n,).

        All are 1/fs if `fs` is given; else the differences of `t`, and the first, which nothing
        precedes, is the median of the others. `RESTART_S` where `restart` is true.

        Raises
        ------
        InputError
            If there is a single sample and no `fs`.
        """
        if self.restart is not None:
            return np.where(self.restart, RESTART_S, replace(self, restart=None).dt)
        if self.fs is not None:
            return np.full(len(self), 1.0 / self.fs)
        if len(self) == 1:
            raise InputError.at(
                f"log {self.name!r}",
                wanted="two rows or more, to know the time step",
                found="one",
                fix="use a longer log, or give fs in an .npz file",
            )
        steps = np.diff(self.t)
        return np.concatenate([[np.median(steps)], steps])


def read_log(path: str | os.PathLike[str]) -> Log:
    """Read a log file: ``.npz`` by its suffix, CSV otherwise.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Log
        Named after the file.

    Raises
    ------
    InputError
        If the file cannot be read or does not hold a log; the one-line message names the file,
        the line and the column (for ``.npz`` the array and the index, counted from 0).
    """
    content = read_bytes(path, "a log file that can be read")
    path = Path(path)
    parse = parse_npz if _is_npz(path) else parse_csv
    arrays = parse(path, content)
    name = path.stem.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    return Log(name=name, mag_new=~np.isnan(arrays["mag"][:, 0]), **arrays)


def write_log(path: str | os.PathLike[str], log: Log) -> None:
    """Write a log file that `read_log` reads back bit for bit.

    Parameters
    ----------
    path : path-like
        With suffix ``.npz`` for that format; anything else is written as CSV.
    log : Log
        CSV has no place for `mov`, `restart` and `fs`: a log that has one of them must go to
        ``.npz``.

    Raises
    ------
    InputError
        If the format cannot hold the log, the file cannot be written, or one is there that this
        function did not write (`boresight.disk.output`).
    """
    OutputFile(path, "write_log").write(log_content(path, log))


def log_content(path: str | os.PathLike[str], log: Log) -> bytes:
    """What `write_log` writes: in the format that the path's suffix says.

    Raises
    ------
    InputError
        The format cannot hold the log.
    """
    path = Path(path)
    keys = ("t", "gyr", "acc", "mag", "q", "mov", "restart", "fs")
    held = {key: getattr(log, key) for key in keys if getattr(log, key) is not None}
    if _is_npz(path):
        return format_npz(held)
    extra = [key for key in ("mov", "restart", "fs") if key in held]
    if extra:
        raise InputError.at(
            str(path),
            wanted="a log without mov, restart and fs, for which CSV has no column",
            found=" and ".join(extra),
            fix="write an .npz file, or leave them out with dataclasses.replace",
        )
    return format_csv(held).encode()


def _is_npz(path: Path) -> bool:
    return path.suffix.lower() == ".npz"


def _unusable(path: Path, wanted: str, error: OSError) -> InputError:
    return InputError.at(str(path), wanted=wanted, found=reason(error), fix="check the path")
