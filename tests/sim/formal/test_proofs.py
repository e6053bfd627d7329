"""The proofs hold (`make formal`: all), and a seeded fault in each kind of block is refuted."""

from dataclasses import replace
from pathlib import Path

import pytest
from amaranth.hdl import Assert, Cover, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

import boresight.gateware.bus.axi
import boresight.gateware.engine.lane
import boresight.gateware.engine.sequencer
from boresight.gateware.machine import machine_named
from boresight.sim.formal import axi, lane, sequencer
from boresight.sim.formal.harness import Harness, Proof, drive, prove
from tests.support.faulty_module import faulty_module

PROOFS = {proof.name: proof for part in (axi, lane, sequencer) for proof in part.PROOFS}
SHORT = ("axi.lite", "lane.18_d7", "sequencer.small")


@pytest.mark.parametrize(
    "name", [n if n in SHORT else pytest.param(n, marks=pytest.mark.soak) for n in PROOFS]
)
def test_proof(name: str, tmp_path: Path) -> None:
    result = prove(PROOFS[name], tmp_path)
    assert result.proven, result


def _refuted(name: str, dut, folder: Path, **changes: int) -> bool:
    return prove(replace(PROOFS[name], dut=dut, cover=1, **changes), folder).refuted


def test_write_of_no_byte_that_is_refused(tmp_path: Path) -> None:
    module = faulty_module(
        boresight.gateware.bus.axi, "Mux(strobes.any() & ~strobes.all()", "Mux(~strobes.all()"
    )
    assert _refuted("axi.lite", lambda: module.AxiLiteSlave(word=8, address=3), tmp_path)


def test_sum_that_is_not_rounded(tmp_path: Path) -> None:
    module = faulty_module(boresight.gateware.engine.lane, "<< (arith.guard - 1)", "<< arith.guard")
    dut = lambda: module.Lane(machine=lane.machine(18, 7))  # noqa: E731
    assert _refuted("lane.18_d7", dut, tmp_path)


def test_idle_within_a_record(tmp_path: Path) -> None:
    module = faulty_module(
        boresight.gateware.engine.sequencer,
        "word.get & ~started & ~self.i_valid",
        "word.get & ~self.i_valid",
    )
    machine = machine_named("small")
    image = sequencer.tiny_image(machine)
    dut = lambda: module.Sequencer(machine=machine, image=image)  # noqa: E731
    assert _refuted("sequencer.small", dut, tmp_path, depth=12)


class Idle(wiring.Component):
    """A count that stays 0."""

    go: In(1)
    count: Out(2)

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.count.eq(self.count & self.go.replicate(2))
        return m


class NeverThree(Harness):
    """The count reaches 3 and stays below it."""

    def surround(self, m, dut):
        drive(m, dut, "go")
        m.d.comb += [Assert(dut.count != 3), Cover(dut.count == 3)]


def test_vacuous_proof_fails(tmp_path: Path) -> None:
    result = prove(Proof(name="idle.count", harness=NeverThree, dut=Idle, depth=3), tmp_path)
    assert not result.proven and not result.refuted and "test_proofs.py" in result.failed[0]
