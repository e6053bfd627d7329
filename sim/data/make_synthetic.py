"""Write ``synthetic_60s.csv`` again: ``python -m boresight.sim.data.make_synthetic OUT.csv``."""

from __future__ import annotations

import sys

from boresight.model.errors import InputError
from boresight.model.tools.files import OutputFile
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.files import content_of
from boresight.sim.records.record import Record

__all__ = ["synthetic_60s"]


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


def main(arguments: list[str]) -> int:
    """Write the log to the only argument; return the exit code."""
    if len(arguments) != 1:
        print("error: usage: python -m boresight.sim.data.make_synthetic OUT.csv", file=sys.stderr)
        return 2
    try:
        file = OutputFile(arguments[0], option="OUT.csv")
        file.write(content_of(arguments[0], synthetic_60s()))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
