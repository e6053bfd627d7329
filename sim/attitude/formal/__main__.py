"""``python -m boresight.sim.attitude.formal [NAME...]``: run the proofs of the attitude board."""

import sys

from boresight.sim.attitude.formal import bus, results, spi, system_bus
from boresight.sim.formal.__main__ import main
from boresight.sim.formal.prove import Proof

PROOFS: tuple[Proof, ...] = tuple(
    proof for module in (bus, results, spi, system_bus) for proof in module.PROOFS
)

if __name__ == "__main__":
    sys.exit(main(PROOFS))
