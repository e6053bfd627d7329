"""VQF, the published attitude filter to measure against, as its own package runs it.

It gives attitudes b to n (ENU) like ours, and wants one rate: a log with other steps gets the
median step, and gaps are filled with the sample that ends them. Without any field it is its
six-axis form. Where the magnetometer has nothing new it is fed the zero vector, which it skips, and
is told the mean step of the magnetometer.

D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and
magnetic disturbance rejection", Information Fusion 91:187, 2023, doi 10.1016/j.inffus.2022.10.014.
"""

from __future__ import annotations

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.tools.extras import optional
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record

#: Classes of the package `vqf` by our names; "basic" is without rest, bias and disturbances.
PEERS = {"vqf_online": "VQF", "vqf_basic": "BasicVQF"}
#: Longest gap [s] that is filled.
_LONGEST_GAP_S = 1.0


def require_peers(names: list[str]) -> None:
    """Raise ToolMissing if the package of these filters is not installed."""
    if names:
        optional("vqf")


def run_peer(name: str, record: Record) -> FloatArray:
    """Attitudes (n, 4) of one of `PEERS`; InputError for a log without the inputs of a filter."""
    log = NineAxis.of(record)
    step = float(np.median(log.dt))
    # The samples of a gap are copies of the next one.
    times = np.clip(np.rint(log.dt / step), 1, _LONGEST_GAP_S / step).astype(np.int64)
    rows, last = np.repeat(np.arange(len(log)), times), np.cumsum(times) - 1
    samples, settings = [log.gyr[rows], log.acc[rows]], {}
    if has_field := log.mag_new.any():
        samples.append(np.zeros_like(samples[0]))
        samples[-1][last] = np.where(log.mag_new[:, None], log.mag, 0.0)
        settings["magTs"] = step * (len(rows) / int(np.count_nonzero(log.mag_new)))
    out = getattr(optional("vqf"), PEERS[name])(step, **settings).updateBatch(*samples)
    return np.asarray(out["quat9D" if has_field else "quat6D"], dtype=np.float64)[last]
