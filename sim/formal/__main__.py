"""``python -m boresight.sim.formal [NAME...]``: run the proofs of the toolkit."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.sim.formal import axi, lane, operands, registers, sequencer
from boresight.sim.formal.prove import Proof, ProofError, prove

PROOFS: tuple[Proof, ...] = (
    *axi.PROOFS,
    *lane.PROOFS,
    *operands.PROOFS,
    *registers.PROOFS,
    *sequencer.PROOFS,
)


def main(proofs: Sequence[Proof] = PROOFS, arguments: list[str] | None = None) -> int:
    """Run proofs.

    Parameters
    ----------
    proofs : sequence of Proof
        Proofs to choose from.
    arguments : list of str, optional
        Command line.

    Returns
    -------
    int
        0: all proven, 1: one failed, 2: wrong arguments or a missing tool.
    """
    parser = argparse.ArgumentParser(description="Run formal proofs.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="beginning of a name; none: all")
    parser.add_argument("--list", action="store_true", help="print names and claims, run nothing")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="proofs at a time")
    parser.add_argument("-o", type=Path, metavar="FOLDER", help="keep logs and counterexamples")
    options = parser.parse_args(arguments)
    chosen = [p for p in proofs if not options.names or p.name.startswith(tuple(options.names))]
    if not chosen:
        print(f"error: NAME: no proof begins with {options.names[0]}; see --list", file=sys.stderr)
        return 2
    if options.list:
        print("\n".join(f"{proof.name:24} {proof.claim}" for proof in chosen))
        return 0
    with tempfile.TemporaryDirectory(prefix="proofs") as name:
        folder = options.o or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        failures = 0
        with ThreadPoolExecutor(options.jobs) as pool:
            try:
                for line, proven in pool.map(partial(_run, folder=folder), chosen):
                    print(line, flush=True)
                    failures += not proven
            except ToolMissing as error:
                print(f"error: {error}", file=sys.stderr)
                return 2
    print(f"{len(chosen) - failures} of {len(chosen)} proven")
    return 1 if failures else 0


def _run(proof: Proof, folder: Path) -> tuple[str, bool]:
    try:
        (folder / proof.name).mkdir(exist_ok=True)
        result = prove(proof, folder=folder / proof.name)
    except ProofError as error:
        return f"{proof.name}: NO ANSWER: {error}", False
    return str(result), result.proven


if __name__ == "__main__":
    sys.exit(main())
