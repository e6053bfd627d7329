"""The proofs of the inertial sensor's reader bite: each sees a reader broken in one place."""

import pytest

import boresight.gateware.sensors.adis16385
from boresight.sim.formal.blocks.inertial_reader import Recovered, Sampled, scaled
from boresight.sim.formal.prove import Proof, prove


def result(broken, harness: type[Sampled], depth: int, induction: int):
    return prove(
        Proof(
            name="inertial.broken",
            claim="",
            harness=lambda: harness(scaled(broken.Adis16385)),
            depth=depth,
            induction=induction,
            cover=range(32, 33),
        )
    )


@pytest.mark.parametrize(
    "old, new",
    [
        # A wait that is a tick short; another answer's check.
        ("r.done.eq(r.timer == 1)", "r.done.eq(r.timer == 2)"),
        ("number if each.byte is None", "number + 1 if each.byte is None"),
    ],
)
def test_broken_reader_is_refuted(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.sensors.adis16385, old, new)
    outcome = result(broken, Sampled, 8, 0)
    assert outcome.refuted and outcome.trace is not None, outcome.report()


@pytest.mark.parametrize(
    "old, new",
    [
        # A burst that begins within a stall; a sample after a wrong one: after a start, too deep
        # for a quick bounded check.
        ("r.edge & ~self.spi.busy", "r.edge"),
        ("~r.invalid & ~doubtful", "~r.invalid"),
    ],
)
def test_broken_reader_is_not_proven(old: str, new: str, mutant) -> None:
    broken = mutant(boresight.gateware.sensors.adis16385, old, new)
    outcome = result(broken, Sampled, 3, 3)
    assert outcome.failed.startswith("not inductive"), outcome.report()


def test_reader_that_gives_no_settings_does_not_recover(mutant) -> None:
    broken = mutant(
        boresight.gateware.sensors.adis16385, "r.known.word_select(high, 8)", "r.known[:8]"
    )
    assert result(broken, Recovered, 3, 3).failed.startswith("not inductive")
