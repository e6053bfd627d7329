"""The proofs of the attitude board hold, and a seeded fault is refuted."""

from dataclasses import replace

import pytest

import boresight.gateware.attitude.sensors.spi
from boresight.sim.attitude.formal.__main__ import PROOFS
from boresight.sim.formal.prove import Proof, prove
from tests.support.faulty_module import faulty_module

SHORT = [proof for proof in PROOFS if proof.short]


@pytest.mark.parametrize("proof", SHORT, ids=lambda proof: proof.name)
def test_short_proof(proof: Proof) -> None:
    result = prove(proof)
    assert result.proven, result


def test_sampled_at_the_wrong_edge() -> None:
    module = faulty_module(
        boresight.gateware.attitude.sensors.spi, "high.eq(left[-1] & ~left[5:-1].any() & ~left[0])",
        "high.eq(left[-1] & ~left[5:-1].any() & left[0])",
    )  # fmt: skip
    proof = next(proof for proof in PROOFS if proof.name == "spi.framed")
    dut = lambda: module.SpiController(half_cycles=3, stall_cycles=3, setup_cycles=6)  # noqa: E731
    assert prove(replace(proof, dut=dut)).refuted
