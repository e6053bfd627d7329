"""What follows from what a pass has placed: gets out of the way, earliest starts, the score."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.list_pass import list_pass
from boresight.gateware.schedule.priorities import paths
from boresight.gateware.schedule.problem import ListProblem, Style
from boresight.gateware.schedule.state import NOTHING, ListState
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value, When
from tests.support.random_program import random_program


def state_of(program: Program) -> ListState:
    machine = CONFIGS["small"]
    work = ListProblem(program, machine, far=paths(program, machine, 1), urgent=1)
    return ListState(work, [0.0] * work.nodes, hold=True, limit=None)


def by_hand(ops: tuple[Op, ...], inputs: int) -> Program:
    """Inputs are values 0, 1, ...; a parameter comes behind them, then the results."""
    values = (
        *(Value(f"x{k}", Kind.INPUT, 31, -1, 1, "test") for k in range(inputs)),
        Value("p", Kind.PARAM, 31, -1, 1, "test", initial=1),
        *(Value(f"y{k}", Kind.OP, 31, -1, 1, "test") for k in range(len(ops))),
    )
    outputs, taken = tuple(op.dest for op in ops), tuple(range(inputs))
    names = tuple(f"y{k}" for k in range(len(ops)))
    return Program("by hand", Arithmetic(), values, ops, taken, outputs, names, (), ())


@pytest.mark.parametrize(
    "writes, cycle, gets",
    [
        ({2}, 2, [0, 1, 3, 4, 5]),
        ({0}, 0, [1, 2, 3, 4, 5]),
        ({4}, 4, [0, 1, 2, 3, 5]),
        ({2, 3, 5}, 2, [0, 1, 4, 6, 7]),
        ({1, 3, 4, 5}, 1, [0, 2, 6, 7, 8]),
        ({9}, 9, [0, 1, 2, 3, 4]),
    ],
)
def test_gets_leave_their_cycles_to_writes(writes: set[int], cycle: int, gets: list[int]) -> None:
    """Each as little as can be, in their order; their values are there a cycle later."""
    state = state_of(by_hand((Op(6, (Term(0, 5, 31),)),), inputs=5))
    state.writes0 = writes
    state.fit(0, NOTHING)
    state.delay(cycle)
    assert state.gets == gets
    assert [state.ready[v] for v in range(5)] == [g + 1 for g in gets]
    assert state.fit(0, NOTHING)[0][0] == gets[0] + 1


@pytest.mark.parametrize("hold", [True, False])
def test_a_result_in_the_way_of_an_input(hold: bool) -> None:
    state = state_of(by_hand((Op(6, (Term(0, 5, 31),)),), inputs=5))
    assert state.may_write(3)  # no input is placed yet
    state.gets, state.horizon, state.hold = [0, 1, 3, 4, 5], 3, hold
    assert state.may_write(2) and state.may_write(6)  # between them, behind them
    assert not state.may_write(1) and not state.may_write(3)  # read already: they stay
    assert state.may_write(4) == hold


def test_a_node_awakes_when_its_captures_could_begin() -> None:
    """One that may take a slot of its own to capture, that much before its terms could start."""
    plain, conditional = Term(1, 3, 31), Term(1, 3, 31, when=When.IF)
    ops = (Op(4, (plain,)), Op(5, (conditional,), flag=0), Op(6, (plain, conditional), flag=1))
    state = state_of(by_hand(ops, inputs=3))
    assert sorted(state.asleep, key=lambda entry: entry[1]) == [(2, 0), (1, 1), (1, 2)]


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
@pytest.mark.parametrize("urgent", [1, 2, 4])
def test_the_score_is_what_the_slots_say(machine: Machine, urgent: int) -> None:
    """Latency, length, slots, sum of the words' cycles."""
    for seed in range(10):
        program = with_copies(random_program(seed, n_ops=30, n_outputs=4))
        far = paths(program, machine, urgent)
        work = ListProblem(program, machine, far=far, urgent=urgent)
        attempt = list_pass(work, [float(-k) for k in range(work.nodes)], Style())
        assert attempt is not None
        slots = work.slots(attempt)
        out = machine.STAGE_READ + 1
        words = [s.cycle + out for k in range(4) for s in slots if s.emit == k]
        written = [s.cycle + machine.STAGE_WRITE + 1 for s in slots if s.last]
        length = max(3, words[-1], *written, *(g + 1 for g in attempt.gets))
        assert len(words) == 4 and words == sorted(words)
        assert attempt.score == (words[urgent - 1], length, len(slots), sum(words))
        assert attempt.length == length


def test_the_program_lasts_until_its_last_word_is_taken() -> None:
    """Also if its results have left before: in a cycle that a write keeps free of gets."""
    ops = (Op(31, (Term(0, 30, 31),)), Op(32, (Term(8, 30, 31),)))
    program = dataclasses.replace(by_hand(ops, inputs=30), outputs=(31,), output_names=("y0",))
    attempt = list_pass(state_of(program).p, [0.0, 0.0, 0.0], Style())
    assert attempt is not None
    latency, length, slots, _ = attempt.score
    assert latency < 20 and slots == 3
    assert attempt.gets[-1] == 31 and length == attempt.length == 32
