"""The runner by itself: what it proves, refutes and refuses."""

from dataclasses import replace

import pytest
from amaranth.hdl import Assert, Assume, Cover, Elaboratable, Module, Signal
from amaranth.lib import memory

from boresight.sim.formal import prove as runner
from boresight.sim.formal.harness import fixed, reached, unknown
from boresight.sim.formal.prove import Proof, ProofError, ProofTimeout, prove


class Counter(Elaboratable):
    """Counts to 9 and begins anew; from 12 on it would stay."""

    def __init__(self, *, limit: int = 9, cover: int | None = 9, go: bool = True) -> None:
        self.limit = limit
        self.cover = cover
        self.go = go

    def elaborate(self, platform):
        m = Module()
        count = Signal(4)
        go = unknown(m, 1, "go")
        with m.If(go & (count < 12)):
            m.d.sync += count.eq(count + 1)
            with m.If(count == 9):
                m.d.sync += count.eq(0)
        m.d.comb += Assert(count <= self.limit)
        if self.cover is not None:
            m.d.comb += Cover(count == self.cover)
        if not self.go:
            m.d.comb += Assume(~go)
        return m


def proof(**changes) -> Proof:
    return replace(
        Proof(name="counter", claim="", harness=Counter, depth=12, induction=2), **changes
    )


def test_proven_by_induction() -> None:
    result = prove(proof())
    assert result.proven and result.method == "induction, k = 1" and result.covers == 1
    assert result.report().startswith("counter: induction, k = 1, 1 covers, ")


def test_bounded_only() -> None:
    result = prove(proof(induction=0))
    assert result.proven and result.method == "bounded, 12 cycles"


@pytest.mark.parametrize("reset", [True, False])
def test_refuted_with_the_run_that_shows_it(reset: bool) -> None:
    result = prove(proof(harness=lambda: Counter(limit=6), reset=reset))
    assert not result.proven and result.refuted
    assert "test_prove.py:" in result.failed
    assert result.trace.values["count"] == (0, 1, 2, 3, 4, 5, 6, 7)
    assert result.trace.values["go"][:7] == (1,) * 7
    assert "\n    7: count=0x7" in result.report()


def test_not_inductive_is_not_refuted() -> None:
    # True, but from 13 the counter would not come down, and the assertion does not exclude 10.
    result = prove(proof(harness=lambda: Counter(limit=10)))
    assert not result.proven and not result.refuted
    assert result.failed.startswith("not inductive: ")
    assert result.trace.values["count"][-1] == 11


def test_assumption_that_forbids_everything_is_found() -> None:
    result = prove(proof(harness=lambda: Counter(go=False)))
    assert not result.proven and result.failed.startswith("not reached: test_prove.py:")


def test_harness_needs_a_cover() -> None:
    result = prove(proof(harness=lambda: Counter(cover=None)))
    assert result.failed == "not reached: the harness has no Cover"


def test_bounded_check_covers_the_induction() -> None:
    with pytest.raises(ValueError, match=r"^depth must be at least induction, 20, not 12$"):
        prove(proof(induction=20))


class Resettable(Elaboratable):
    """Says that a register, once 1, stays so."""

    def elaborate(self, platform):
        m = Module()
        was = Signal()
        kept = Signal(reset_less=True)
        m.d.sync += [was.eq(1), kept.eq(1)]
        m.d.comb += [Assert(was | ~kept), reached(m, was, "set")]
        return m


def test_reset_comes_at_any_time() -> None:
    assert prove(proof(harness=Resettable, depth=4)).refuted
    assert prove(proof(harness=Resettable, depth=4, reset=False)).proven


class Remembered(Elaboratable):
    """A word of a memory, and a ROM, whose contents induction has to know."""

    def elaborate(self, platform):
        m = Module()
        m.submodules.ram = ram = memory.Memory(shape=3, depth=4, init=[])
        m.submodules.rom = rom = memory.Memory(shape=3, depth=4, init=[5, 1, 5, 1])
        w = ram.write_port()
        r = ram.read_port(domain="comb")
        c = rom.read_port(domain="comb")
        index = fixed(m, 2, "index")
        copy = Signal(3)
        m.d.comb += [
            w.addr.eq(unknown(m, 2, "where")),
            w.data.eq(unknown(m, 3, "what")),
            w.en.eq(unknown(m, 1, "write")),
            r.addr.eq(index),
            c.addr.eq(index),
        ]
        with m.If(w.en & (w.addr == index)):
            m.d.sync += copy.eq(w.data)
        m.d.comb += [Assert(r.data == copy), Assert(c.data[0]), reached(m, copy == 5, "five")]
        return m


def test_memories() -> None:
    assert prove(proof(harness=Remembered, depth=4, reset=False)).method == "induction, k = 1"


def test_timeout() -> None:
    with pytest.raises(ProofTimeout, match=r"^no answer within 0\.001 s$"):
        prove(proof(), timeout_s=0.001)


def test_yosys_refusal_is_told(monkeypatch) -> None:
    monkeypatch.setattr(runner, "_SCRIPT", "read_rtlil nothing.il\n")
    with pytest.raises(ProofError, match=r"^yosys did not take the harness: .*nothing\.il"):
        prove(proof())
