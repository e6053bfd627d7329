"""Convert an x-IMU recording: ``python -m boresight.sim.data.convert_ximu FOLDER OUT.csv``.

FOLDER holds the CSV files that the x-IMU software writes, each with a packet number in its first
column: ``*_CalInertialAndMag.csv``, ``*_Quaternion.csv`` and ``*_Registers.csv``. ``README.md``
beside this file says what each step rests on.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.model.tools.files import OutputFile
from boresight.sim.records.files import content_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
)

__all__ = ["convert", "main"]


#: Sampling rate of the inertial packets [Hz]: 128 of them lie between the half-second marks.
_RATE_HZ = 256.0
#: Microtesla per gauss.
_UT_PER_GAUSS = 100.0
#: Turns axes (north, west, up) into (east, north, up): 90 degrees about the vertical.
_ENU_FROM_NWU = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
#: Decimals kept of gyr, acc, mag and q: at least a hundred steps to one of the device's own.
_DECIMALS = (7, 5, 4, 7)

_NOTE = """\
# x-IMU recording 00033 from scikit-kinematics 0.10.4 (BSD-3-Clause, (C) 2016 Thomas Haslwanter).
# qw..qz is the device's own estimate: a comparison, not truth. See README.md beside this file.
"""


def convert(folder: Path) -> Record:
    """Read an x-IMU folder.

    Parameters
    ----------
    folder : Path
        With exactly one recording.

    Returns
    -------
    Record
        Nine axes, 256 Hz. The field is new where the reading changed; the attitude is the device's
        estimate, in ENU and free of its tare, in the rows after which the device sent one.

    Raises
    ------
    InputError
        If a file is missing or not as expected, or a packet was lost.
    """
    inertial = _table(folder, "CalInertialAndMag", 10)
    sent = _table(folder, "Quaternion", 5)
    tare = _tare(folder)

    # The reading before the first quaternion is a transient of the start.
    first = int(np.searchsorted(inertial[:, 0], sent[0, 0]))
    inertial = inertial[first:]
    row = np.searchsorted(inertial[:, 0], sent[:, 0]) - 1
    sent, row = sent[row >= 0], row[row >= 0]
    if np.any(np.diff(row) != 2):
        raise InputError(f"{folder}: wanted two inertial packets to each quaternion, found a gap")

    # Sent is earth relative to sensor, and earth itself turned by the tare.
    untared = quaternion_multiply(tare, quaternion_conjugate(sent[:, 1:]))
    q = np.full((len(inertial), 4), np.nan)
    q[row] = quaternion_normalise(quaternion_multiply(_ENU_FROM_NWU, untared))

    mag = inertial[:, 7:10]
    mag_new = np.concatenate([[True], np.any(np.diff(mag, axis=0) != 0, axis=1)])
    gyr, acc, mag, q = (
        np.round(value, decimals)
        for value, decimals in zip(
            (np.radians(inertial[:, 1:4]), inertial[:, 4:7] * GRAVITY, mag * _UT_PER_GAUSS, q),
            _DECIMALS,
            strict=True,
        )
    )
    mag[~mag_new] = np.nan
    return NineAxis("ximu_walk", np.arange(len(inertial)) / _RATE_HZ, gyr, acc, mag, q).record()


def _only(folder: Path, kind: str) -> Path:
    matches = sorted(folder.glob(f"*_{kind}.csv"))
    if len(matches) != 1:
        raise InputError.at(
            str(folder),
            wanted=f"one file *_{kind}.csv",
            found=str(len(matches)),
            fix="give the folder of one x-IMU recording",
        )
    return matches[0]


def _table(folder: Path, kind: str, width: int) -> FloatArray:
    path = _only(folder, kind)
    try:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: wanted a table of numbers, found: {error}") from None
    if table.shape[1] != width:
        raise InputError(f"{path}: wanted {width} columns, found {table.shape[1]}")
    return table


def _tare(folder: Path) -> FloatArray:
    path = _only(folder, "Registers")
    with path.open(newline="", encoding="utf-8") as stream:
        value = {row["Name"]: row["Fixed-point value"] for row in csv.DictReader(stream)}
    try:
        tare = [float(value[f"AlgorithmTareQuat{k}"]) for k in range(4)]
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: wanted AlgorithmTareQuat0 to 3, found: {error}") from None
    return quaternion_normalise(tare)


def main(arguments: list[str]) -> int:
    """Convert the folder (first argument) to the file (second); return the exit code."""
    if len(arguments) != 2:
        print(
            "error: usage: python -m boresight.sim.data.convert_ximu FOLDER OUT.csv",
            file=sys.stderr,
        )
        return 2
    folder, out = Path(arguments[0]), arguments[1]
    try:
        inputs = folder.glob("*.csv") if folder.is_dir() else ()
        file = OutputFile(out, inputs=inputs, option="OUT.csv")
        file.write(_NOTE.encode() + content_of(out, convert(folder)))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
