"""The proofs of the SPI bite: each refutes a controller that is broken in one place."""

import pytest

import boresight.gateware.serial.spi
from boresight.sim.formal.blocks.spi import Framed
from boresight.sim.formal.prove import Proof, prove


def result(broken, depth: int):
    half, stall, setup = 3, 4, 3

    def harness() -> Framed:
        dut = broken.SpiController(half_cycles=half, stall_cycles=stall, setup_cycles=setup)
        return Framed(dut, stall=stall, setup=setup, whole=False)

    return prove(
        Proof(name="spi.broken", claim="", harness=harness, depth=depth, induction=2, cover=15)
    )


@pytest.mark.parametrize(
    "old, new",
    [
        # A stall or a half period that is too short; no stall after a reset.
        ("rest = base - 1 - self.stall_halves", "rest = base - self.stall_halves"),
        (
            "m.d.sync += timer.eq(self.half_cycles - 1)",
            "m.d.sync += timer.eq(self.half_cycles - 2)",
        ),
        ("init=base - 1", "init=0"),
        # cs_n rises early; the answer comes from the pin itself, or one bit early.
        ("self.cs_n.eq(last | ~left[-1])", "self.cs_n.eq(high | ~left[-1])"),
        ("word.eq(Cat(miso, word))", "word.eq(Cat(self.miso, word))"),
        ("with m.If(high):", "with m.If(high | (left == base + 2 * BITS)):"),
    ],
)
def test_broken_controller_is_refuted(old: str, new: str, mutant) -> None:
    outcome = result(mutant(boresight.gateware.serial.spi, old, new), 20)
    assert outcome.refuted and outcome.trace is not None, outcome.report()


@pytest.mark.parametrize(
    "old, new",
    [
        # A 17th clock; a command taken while another one is on its way, or after a longer stall; an
        # answer said twice: all of it at the end of a frame, too deep for a quick bounded check.
        ("(high & ~last)", "high"),
        ("self.i.ready.eq(idle)", "self.i.ready.eq(idle | last)"),
        ("idle.eq(left == rest + 1)", "idle.eq(left == rest)"),
        ("self.o_valid.eq(0), ", ""),
    ],
)
def test_controller_that_ends_a_frame_wrongly_is_not_proven(old: str, new: str, mutant) -> None:
    outcome = result(mutant(boresight.gateware.serial.spi, old, new), 3)
    assert outcome.failed.startswith("not inductive"), outcome.report()


def test_the_controller_as_it_is() -> None:
    assert result(boresight.gateware.serial.spi, 3).proven
