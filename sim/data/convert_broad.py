"""Trials of the BROAD data set as logs: ``python -m boresight.sim.data.convert_broad FOLDER OUT``.

They lie in ``data_mat`` of https://github.com/dlaidig/broad (CC BY 4.0): rates, specific force,
field, optical attitude (sensor to ENU), and which samples move.

D. Laidig, M. Caruso, A. Cereatti, T. Seel, "BROAD - A Benchmark for Robust Inertial Orientation
Estimation", Data 6(7):72, 2021, doi 10.3390/data6070072.
"""

import sys
from pathlib import Path

import numpy as np

from boresight.model.tools.extras import optional


def convert(trial: Path, log: Path) -> None:
    """Write a trial, a ``.mat`` file, as an ``.npz`` log."""
    held = optional("scipy.io").loadmat(trial)
    names = {"gyr": "imu_gyr", "acc": "imu_acc", "mag": "imu_mag", "q": "opt_quat"}
    arrays = {name: held[key] for name, key in names.items()}
    fs, mov = held["sampling_rate"].item(), held["movement"].ravel()
    np.savez_compressed(log, t=np.arange(len(mov)) / fs, fs=fs, mov=mov, **arrays)


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    target.mkdir(parents=True, exist_ok=True)
    for path in sorted(source.glob("*.mat")):
        convert(path, target / f"{path.stem}.npz")
