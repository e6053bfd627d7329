"""``python -m boresight.sim.attitude.soc``: filters in C on the soft core, beside the core."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from boresight.model.attitude import FILTERS
from boresight.model.errors import InputError, ToolMissing
from boresight.model.tools.failure import ToolFailed
from boresight.sim.attitude.soc.measure import compare
from boresight.sim.attitude.soc.offload import offload
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.result import Result
from boresight.sim.rtl.simulators import SimulationFailed


def main(arguments: Sequence[str]) -> int:
    """Print the figures; return 1 if words differ, 2 for bad usage or a missing compiler."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.soc")
    parser.add_argument("filters", nargs="*", help="by default all four of the board")
    parser.add_argument("--updates", type=int, default=1000, help="recorded updates (%(default)s)")
    given = parser.parse_args(arguments)
    log = read_record(bundled("ximu_walk"))
    try:
        rows = [compare(name, log, updates=given.updates) for name in given.filters or FILTERS]
        bus = offload(log, updates=given.updates)
    except (InputError, ToolMissing, ToolFailed, SimulationFailed) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    failures = [f"{row['filter']}: its C differs from the model" for row in rows if not row["good"]]
    if bus["mismatches"] or bus["in_memory"] < bus["updates"] - 1:
        failures.append(f"{bus['filter']}: words over the bus differ from the model")
    result = Result(
        data={"software": rows, "offload": bus},
        tables={"Median cycles of an update": rows, "The core through the bus": [bus]},
        failures=failures,
    )
    print(result)
    return int(not result.good)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
