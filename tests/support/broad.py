"""Trials as BROAD stores them."""

from __future__ import annotations

import numpy as np


def trial(rows: int = 40) -> dict[str, object]:
    rng = np.random.default_rng(1)
    q = rng.standard_normal((rows, 4))
    q[3] = np.nan
    return {
        "imu_gyr": rng.standard_normal((rows, 3)),
        "imu_acc": rng.standard_normal((rows, 3)),
        "imu_mag": rng.standard_normal((rows, 3)),
        "opt_quat": q / np.linalg.norm(q, axis=1, keepdims=True),
        "movement": np.arange(rows)[:, None] > 10,
        "sampling_rate": 2000.0 / 7.0,
    }
