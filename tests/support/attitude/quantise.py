"""A nine-axis record as the data of a board's sensors."""

from __future__ import annotations

import numpy as np

from boresight.model.attitude.front import STAMP_BITS
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples
from boresight.sim.attitude.board.run import field_words, heading_words, inertial_words
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record


def quantise(
    record: Record,
    *,
    clock_hz: float = 100e6,
    kind: int = COUNTS,
    line_hz: float = 8.0,
    number: int = 0,
) -> Samples:
    """Return a nine-axis record as the data of an ADIS16385 and an HMR3300.

    Sensor axes are body axes. Rates and forces beyond the sensors' full scale are clamped there.

    Parameters
    ----------
    clock_hz : float
        Clock of the time stamps.
    kind : int
        Lines of the compass: `NO_LINE`, `COUNTS` (of the record's field) or `HEADING` (of its
        reference attitude).
    line_hz : float
        Maximum lines in a second.
    number : int
        Number of the filter.

    Raises
    ------
    InputError
        Headings of a record without reference attitude.
    """
    log = NineAxis.of(record)
    n = len(log)
    stamp = np.rint((log.t - log.t[0]) * clock_hz).astype(np.int64)
    has_sample = np.isfinite(log.attitude).all(axis=1) if kind == HEADING else log.mag_new
    line = np.full(n, NO_LINE)
    next_line = log.t[0]
    for k in np.flatnonzero(has_sample) if kind != NO_LINE else ():
        if log.t[k] >= next_line:
            line[k] = kind
            next_line = max(next_line + 1.0 / line_hz, log.t[k])
    values = np.zeros((n, 3), dtype=np.int64)
    rows = line != NO_LINE
    if kind == HEADING:
        values[rows] = heading_words(log.attitude[rows])
    elif kind == COUNTS:
        values[rows] = field_words(log.mag[rows])
    restart = np.zeros(n, dtype=np.bool_)
    restart[0] = True
    return Samples(
        stamp % (1 << STAMP_BITS), inertial_words(log), line, values, restart, np.full(n, number)
    )
