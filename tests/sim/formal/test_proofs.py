"""The short proofs hold, and a seeded fault in each kind of block is refuted."""

from dataclasses import replace

import pytest
from amaranth.hdl import Assert, Cover, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

import boresight.gateware.bus.axi
import boresight.gateware.engine.lane
import boresight.gateware.engine.sequencer
from boresight.gateware.machine import machine_named
from boresight.sim.formal import lane, sequencer
from boresight.sim.formal.__main__ import PROOFS, main
from boresight.sim.formal.harness import Harness, Proof, drive, prove
from tests.support.faulty_module import faulty_module


@pytest.mark.parametrize("name", ["axi.lite", "lane.18_d7", "sequencer.small"])
def test_short_proof(name: str) -> None:
    result = prove(_named(name))
    assert result.proven, result


def test_names_and_claims() -> None:
    assert len({proof.name for proof in PROOFS}) == len(PROOFS)
    assert all(proof.claim for proof in PROOFS)


def _named(name: str) -> Proof:
    return next(proof for proof in PROOFS if proof.name == name)


def _refuted(proof: Proof, dut) -> bool:
    return prove(replace(proof, dut=dut)).refuted


def test_write_of_no_byte_that_is_refused() -> None:
    module = faulty_module(
        boresight.gateware.bus.axi, "Mux(strobes.any() & ~strobes.all()", "Mux(~strobes.all()"
    )
    assert _refuted(_named("axi.lite"), lambda: module.AxiLiteSlave(word=8, address=3))


def test_sum_that_is_not_rounded() -> None:
    module = faulty_module(boresight.gateware.engine.lane, "<< (arith.guard - 1)", "<< arith.guard")
    dut = lambda: module.Lane(machine=lane.machine(18, 7))  # noqa: E731
    assert _refuted(_named("lane.18_d7"), dut)


def test_idle_within_a_record() -> None:
    module = faulty_module(
        boresight.gateware.engine.sequencer,
        "word.get & ~started & ~self.i_valid",
        "word.get & ~self.i_valid",
    )
    machine = machine_named("small")
    image = sequencer.tiny_image(machine)
    proof = replace(_named("sequencer.small"), depth=12)
    assert _refuted(proof, lambda: module.Sequencer(machine=machine, image=image))


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


def test_vacuous_proof_fails() -> None:
    result = prove(Proof(name="idle.count", harness=NeverThree, dut=Idle, depth=3))
    assert not result.proven and not result.refuted and "test_proofs.py" in result.failed[0]


def test_command_line(capsys, tmp_path) -> None:
    assert main(["axi.lite", "-o", str(tmp_path)]) == 0
    assert "1 of 1 proven" in capsys.readouterr().out
    assert (tmp_path / "axi.lite").is_dir()
    assert main(["nothing"]) == 2
