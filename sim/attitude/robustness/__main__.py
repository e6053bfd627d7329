"""Run attitude filters on logs that are made harder in one way each.

``python -m boresight.sim.attitude.robustness mekf,vqf_online LOG... [--cases full] [-o OUT.json]``:
each log is cut to start in motion, biased, resampled, turned, blinded and so on.
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

from boresight.model.errors import InputError
from boresight.model.resolve import split_names
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.attitude.robustness.plan import LISTS, cases_of
from boresight.sim.attitude.robustness.runs import Suite, run_log
from boresight.sim.attitude.robustness.summary import summary
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import log_files
from boresight.sim.result import Result


def robustness(
    names: Sequence[str], logs: Sequence[str | Path] = (), *, cases: str = "short", jobs: int = 1
) -> Result:
    """Run estimators and published filters by name on logs in every case.

    Parameters
    ----------
    names : sequence of str
        Estimators, also ``file.py:Class``, and published filters.
    logs : sequence of path
        Logs or folders of logs with a reference attitude; by default the bundled synthetic log.
    cases : str
        "full" or "short".
    jobs : int
        Number of processes.

    Raises
    ------
    InputError
        Unknown cases or filter, a bad log, a package of a published filter that is not installed.
    """
    plan = cases_of(cases)
    peers = [name for name in names if name in PEERS]
    require_peers(peers)
    suite = Suite(cases, [name for name in names if name not in PEERS], peers)
    files = log_files(logs) if logs else [bundled("synthetic_60s")]
    if jobs == 1:
        results = list(map(partial(run_log, suite), files))
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            results = list(pool.map(partial(run_log, suite), files))
    return summary(plan, [row for rows in results for row in rows])


def main(arguments: Sequence[str]) -> int:
    """Print the tables; return 1 if a filter fails, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.robustness")
    parser.add_argument("filters", help="estimators and published filters, with commas between")
    parser.add_argument("logs", nargs="*", help="logs, or folders of logs, with truth")
    parser.add_argument("--cases", default="short", choices=LISTS)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, help="JSON file with every row")
    given = parser.parse_args(arguments)
    try:
        names = split_names(given.filters)
        result = robustness(names, given.logs, cases=given.cases, jobs=given.jobs)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    if given.output:
        given.output.write_text(json.dumps(result.to_json(), indent=1) + "\n", encoding="utf-8")
    print(result)
    return int(not result.good)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
