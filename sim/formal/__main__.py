"""``python -m boresight.sim.formal [NAME...]``: run the proofs; ``--list`` prints their claims."""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from boresight.model.errors import ToolMissing
from boresight.sim.formal import axi, lane, sequencer
from boresight.sim.formal.harness import Proof, ProofError, prove

MODULES: tuple[Any, ...] = (axi, lane, sequencer)
PROOFS: tuple[Proof, ...] = tuple(proof for module in MODULES for proof in module.PROOFS)


def main(arguments: list[str] | None = None) -> int:
    """Run proofs; return 0: all proven, 1: one failed, 2: wrong arguments or a missing tool."""
    parser = argparse.ArgumentParser(description="Run formal proofs.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="beginning of a name; none: all")
    parser.add_argument("--list", action="store_true", help="print names and claims, run nothing")
    parser.add_argument("-o", type=Path, metavar="FOLDER", help="keep logs and counterexamples")
    options = parser.parse_args(arguments)
    chosen = [p for p in PROOFS if not options.names or p.name.startswith(tuple(options.names))]
    if not chosen:
        print(f"error: NAME: no proof begins with {options.names[0]}; see --list", file=sys.stderr)
        return 2
    if options.list:
        print("\n".join(f"{proof.name:24} {proof.claim}" for proof in chosen))
        return 0

    def run(proof: Proof) -> bool:
        folder = options.o / proof.name if options.o else None
        try:
            result = prove(proof, folder=folder)
            text, proven = str(result), result.proven
        except ProofError as error:
            text, proven = f"NO ANSWER: {error}", False
        print(f"{proof.name}: {text}", flush=True)
        return proven

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        try:
            proven = sum(pool.map(run, chosen))
        except ToolMissing as error:
            print(f"error: {error}", file=sys.stderr)
            return 2
    print(f"{proven} of {len(chosen)} proven")
    return int(proven < len(chosen))


if __name__ == "__main__":
    sys.exit(main())
