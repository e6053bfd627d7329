"""The short proofs hold, and the page that claims them names them all."""

from pathlib import Path

import pytest

from boresight.sim.formal.prove import Proof, prove
from boresight.sim.formal.registry import all_proofs, find_proofs

PAGE = Path(__file__).parents[3] / "docs" / "proofs.md"


@pytest.mark.parametrize("proof", find_proofs([], short=True), ids=lambda proof: proof.name)
def test_short_proof(proof: Proof) -> None:
    result = prove(proof)
    assert result.proven, result.report()
    assert result.method.startswith("induction") == bool(proof.induction)


def test_page_names_every_proof() -> None:
    text = PAGE.read_text()
    missing = [proof.name for proof in all_proofs() if f"`{proof.name}`" not in text]
    assert not missing
