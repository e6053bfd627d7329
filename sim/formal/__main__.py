"""``python -m boresight.sim.formal [NAME...] [--short]``: run the proofs and print a table.

They run in one process for each processor; lines are in the order of completion.
"""

from __future__ import annotations

import argparse
import sys
import time

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.campaign import dispatch
from boresight.sim.formal.prove import TIMEOUT_S
from boresight.sim.formal.registry import find_proofs, prove_named
from boresight.sim.formal.tools import SOLVERS, find_tools


def main(arguments: list[str] | None = None) -> int:
    """Run the proofs; 0: all proven, 1: one failed, 2: wrong arguments or a missing tool."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.formal", description=__doc__)
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help="a proof, or a part for all of its proofs; none: all",
    )
    parser.add_argument("--short", action="store_true", help="only proofs that take seconds")
    parser.add_argument("--list", action="store_true", help="print names and claims, run nothing")
    parser.add_argument(
        "--solver", choices=SOLVERS, help="solver; by default the first one installed"
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=TIMEOUT_S,
        metavar="SECONDS",
        help="longest run of one step (default %(default)g)",
    )
    parser.add_argument(
        "--jobs", type=int, metavar="N", help="processes; by default one for each processor"
    )
    options = parser.parse_args(arguments)
    try:
        proofs = find_proofs(options.names, short=options.short)
        if options.list:
            for proof in proofs:
                print(f"{proof.name:32} {proof.claim}")
            return 0
        tools = find_tools(options.solver)
    except (InputError, ToolMissing) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    width = max(len(proof.name) for proof in proofs)
    proven_count, start = 0, time.monotonic()
    tasks = [(p.name, prove_named, (p.name, options.solver, options.timeout)) for p in proofs]
    for number, (name, (proven, line)) in enumerate(dispatch(options.jobs, tasks), 1):
        print(f"[{number:2}/{len(proofs)}] {name:{width}} {line}", flush=True)
        proven_count += proven
    seconds = time.monotonic() - start
    print(f"{proven_count} of {len(proofs)} proven in {seconds:.1f} s with {tools.solver}")
    return 0 if proven_count == len(proofs) else 1


if __name__ == "__main__":
    sys.exit(main())
