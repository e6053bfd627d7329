"""``python -m boresight.sim.formal [NAME...] [--short]``: run the proofs and print a table."""

from __future__ import annotations

import argparse
import sys

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.formal.prove import TIMEOUT_S, ProofError, prove
from boresight.sim.formal.registry import find_proofs
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
    good, seconds = 0, 0.0
    for number, proof in enumerate(proofs, 1):
        print(f"[{number:2}/{len(proofs)}] {proof.name:{width}} ", end="", flush=True)
        try:
            result = prove(proof, tools=tools, timeout_s=options.timeout)
        except ProofError as error:
            print(f"NO ANSWER: {error}")
            continue
        good += result.proven
        seconds += result.seconds
        if result.proven:
            print(f"proven  {result.method:24} {result.covers:2} covers {result.seconds:7.1f} s")
        else:
            print(f"FAILED after {result.seconds:.1f} s\n{result.report()}")
    print(f"{good} of {len(proofs)} proven in {seconds:.1f} s with {tools.solver}")
    return 0 if good == len(proofs) else 1


if __name__ == "__main__":
    sys.exit(main())
