"""Run attitude filters on logs that are made harder in one way each (`variants.CASES`).

``python -m boresight.sim.attitude.robustness mekf,vqf_online LOG... [-o OUT.json]``
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from boresight.model.errors import InputError, require
from boresight.model.resolve import estimator_of, split_names
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.attitude.robustness.runs import run_log, summary
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import log_files


def main(arguments: Sequence[str]) -> int:
    """Print the tables; return 1 if a filter fails, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.robustness")
    parser.add_argument("filters", help="estimators and published filters, with commas between")
    parser.add_argument("logs", nargs="*", help="logs, or folders of logs, with truth")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, help="JSON file with every row")
    given = parser.parse_args(arguments)
    try:
        require(given.jobs >= 1, "--jobs", "1 or more", given.jobs)
        names = split_names(given.filters)
        require_peers([name for name in names if name in PEERS])
        for name in names:
            good = name in PEERS or gives_attitude(estimator_of(name))
            require(good, "filters", "estimators with outputs qw qx qy qz", name, "name others")
        files = log_files(given.logs) if given.logs else [bundled("synthetic_60s")]
        with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool:
            rows = [row for rows in pool.map(partial(run_log, names), files) for row in rows]
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    result = summary(rows)
    if given.output:
        given.output.write_text(json.dumps(result.to_json(), indent=1) + "\n", encoding="utf-8")
    print(result)
    return int(not result.good)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
