"""Write ``synthetic_60s.csv`` again: ``python -m`` this module, then the name of the file."""

from __future__ import annotations

import sys
from pathlib import Path

from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.files import content_of
from boresight.sim.records.record import Record


def synthetic_60s() -> Record:
    """Make the bundled log: 100 Hz, modest sensor errors, a magnetometer at 10 Hz, exact truth."""
    return synthetic_log(
        seconds=60.0,
        rate_hz=100.0,
        seed=20140,
        acceleration=0.5,
        mag_every=10,
        gyr_error=SensorError(noise=0.003, bias=(0.002, -0.003, 0.001)),
        acc_error=SensorError(noise=0.05),
        mag_error=SensorError(noise=0.3),
        name="synthetic_60s",
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(content_of(sys.argv[1], synthetic_60s()))
