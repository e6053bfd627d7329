"""Trials of the BROAD data set as logs: ``python -m boresight.sim.data.convert_broad FOLDER OUT``.

They lie in ``data_mat`` of https://github.com/dlaidig/broad (CC BY 4.0): rates, specific force,
field, optical attitude (sensor to ENU), and which samples move.

D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD - A Benchmark for Robust Inertial Orientation
Estimation", Data 6(7):72, 2021, doi 10.3390/data6070072.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.files import content_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record

#: Arrays of a trial, and their widths.
_ARRAYS = {"imu_gyr": 3, "imu_acc": 3, "imu_mag": 3, "opt_quat": 4, "movement": 1}


def broad_trials(folder: Path) -> list[Path]:
    """The trials of a folder.

    Raises
    ------
    InputError
        It holds none.
    """
    paths = sorted(folder.glob("*.mat"))
    if not paths:
        raise InputError.at(
            str(folder), wanted="BROAD's .mat files", found="none", fix="name its data_mat"
        )
    return paths


def broad_record(path: Path) -> Record:
    """One trial, a ``.mat`` file.

    Raises
    ------
    InputError
        It is none of BROAD.
    ToolMissing
        scipy, which reads it, is not installed.
    """
    loadmat = optional("scipy.io").loadmat
    try:
        held = loadmat(path, variable_names=[*_ARRAYS, "sampling_rate"])
        rate_hz = float(np.asarray(held["sampling_rate"]).item())
        arrays = {n: np.asarray(held[n], np.float64).reshape(-1, k) for n, k in _ARRAYS.items()}
    except Exception as error:  # scipy lets out whatever its readers of damaged bytes meet
        raise InputError.at(
            str(path),
            wanted="a trial of BROAD's data_mat",
            found=str(error).splitlines()[0] if str(error) else type(error).__name__,
            fix="name a folder with its .mat files",
        ) from None
    count = len(arrays["imu_gyr"])
    if rate_hz <= 0.0 or {len(a) for a in arrays.values()} != {count}:
        raise InputError.at(
            str(path),
            wanted="a rate, and a row for each sample in every array",
            found=f"{rate_hz:g} Hz, rows {[len(a) for a in arrays.values()]}",
            fix="fetch it again",
        )
    gyr, acc, mag, q = (arrays[n] for n in ("imu_gyr", "imu_acc", "imu_mag", "opt_quat"))
    t, steps = np.arange(count) / rate_hz, np.full(count, 1.0 / rate_hz)
    mov = np.asarray(arrays["movement"][:, 0] != 0.0)
    return NineAxis(path.stem, t, gyr, acc, mag, q, steps, mov).record()


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    target.mkdir(parents=True, exist_ok=True)
    for trial in broad_trials(source):
        log = target / f"{trial.stem}.npz"
        log.write_bytes(content_of(log, broad_record(trial)))
        print(log)
