"""Numbers that the paper prints, and their own statistics."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["BUDGET", "HOURLY", "SIGMA", "statistics"]

FloatArray = npt.NDArray[np.float64]

#: Table 1, heading by the old method: allocated, real [arcsec]; Tables 2 and 3 are lost.
BUDGET = {
    "gyro theodolite": (10.0, 25.0),
    "prism": (18.0, 28.0),
    "deformation of the trunnions": (18.0, 18.0),
    "play of the encoder": (25.0, 35.0),
    "finding north": (15.0, 25.0),
    "total, as printed": (40.0, 60.0),
}
#: Tables 4 and 5: errors of pitch, roll, heading after each hour [arcsec].
HOURLY = {
    "a": np.array(
        [
            *([-2.83, -22.84, -2.31], [-2.40, 0.85, -18.14], [-1.51, -31.10, 12.71]),
            *([-1.66, 16.36, -43.51], [-3.25, -47.10, 6.45], [-3.09, 27.46, -60.82]),
            *([-2.45, -51.51, 10.57], [19.81, -1.71, -51.81]),
        ]
    ),
    "b": np.array(
        [
            *([-3.42, -7.74, -0.05], [-0.31, -6.29, -0.15], [1.47, -7.25, -0.33]),
            *([5.74, -5.93, -0.57], [9.17, -7.08, -0.83], [12.53, -10.95, -1.03]),
            *([18.58, -14.91, -1.12], [15.78, -26.25, 52.03]),
        ]
    ),
}
#: Their last rows, "1 sigma".
SIGMA = {"a": (7.90, 28.99, 29.83), "b": (7.92, 6.92, 18.61)}


def statistics(hourly: FloatArray) -> dict[str, FloatArray]:
    """Of hourly errors (hours, 3): deviation from their mean (n - 1), rms, most; (3,) each."""
    return {
        "sigma": hourly.std(axis=0, ddof=1) if len(hourly) > 1 else np.zeros(3),
        "rms": np.sqrt(np.mean(hourly**2, axis=0)),
        "max": np.abs(hourly).max(axis=0),
    }
