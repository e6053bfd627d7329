"""The graph that list scheduling works on, and how a pass's groups become slots."""

from __future__ import annotations

import pytest

from boresight.gateware.machine import CONFIGS
from boresight.gateware.schedule.priorities import paths
from boresight.gateware.schedule.problem import Attempt, ListProblem
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value, When

#: Values: x, p, the state s, then one for each op.
OPS = (
    Op(3, (Term(0, 1, 22),)),
    Op(4, (Term(3, 3, 22), Term(2, 1, 22))),
    Op(5, (Term(1, 1, 22, when=When.IF),), flag=3),
)
PROGRAM = Program(
    "graph",
    Arithmetic(),
    (
        Value("x", Kind.INPUT, 31, -1, 1, "test"),
        Value("p", Kind.PARAM, 31, -1, 1, "test", initial=1),
        Value("s", Kind.STATE, 31, -1, 1, "test"),
        *(Value(f"y{op.dest}", Kind.OP, 31, -1, 1, "test") for op in OPS),
    ),
    OPS,
    (0,),
    (4, 3, 0),
    ("a", "b", "c"),
    ((2, 5),),
    (),
)


@pytest.fixture(params=CONFIGS.values(), ids=CONFIGS)
def problem(request: pytest.FixtureRequest) -> ListProblem:
    return ListProblem(PROGRAM, request.param, far=paths(PROGRAM, request.param, 1), urgent=1)


def test_ops_then_emits_each_after_what_it_reads(problem: ListProblem) -> None:
    """A flag is read as an operand is; emits keep the order of the stream, whatever they show."""
    assert (problem.n_ops, problem.nodes) == (3, 6)
    assert problem.producers == [[], [0], [0], [1], [0, 3], [4]]
    assert problem.consumers == [[1, 2, 4], [3], [], [4], [5], []]
    assert problem.waits == [len(before) for before in problem.producers]
    assert problem.makes_state == [False, False, True]


def test_room_for_states(problem: ListProblem) -> None:
    machine = problem.machine
    assert problem.state_quota == (128 // machine.lanes,) * machine.lanes
    far = paths(PROGRAM, machine, 1)
    assert ListProblem(PROGRAM, machine, far=far, urgent=1, state_quota=[5]).state_quota == (5,)


def test_who_could_capture_for_whom(problem: ListProblem) -> None:
    """Op 1 reads the value that is op 2's flag: it could capture its sign."""
    assert problem.keys == [(None, None, None), (None, None, None), (None, (3, False), None)]
    assert problem.givers == {(1, (3, False)): [1]}


def test_ways_to_lay_out_a_node_are_found_once(problem: ListProblem) -> None:
    need = problem.needs[2]
    found = problem.arranged(2, need)
    assert found and problem.arranged(2, need) is found
    assert problem.arranged(2, (False, False, False)) != found
    (emit,) = problem.arranged(5, (False, False, False))
    assert emit.slots == (Slot(0, 0, 0, emit=2),) and emit.before == ()


def test_groups_as_slots(problem: ListProblem) -> None:
    two = (Slot(0, 0, 3, 3, op=1, term=0), Slot(0, 0, 2, 1, op=1, term=1))
    one = (Slot(0, 0, 0, 1, op=0, term=0),)
    emit = (Slot(0, 0, 4, emit=0),)
    attempt = Attempt((0, 0, 0, 0), ((1, 1, 10, two), (3, 0, 20, emit), (0, 0, 11, one)), (0,), 30)
    found = [
        (s.cycle, s.lane, s.op, s.term, s.emit, s.first, s.last) for s in problem.slots(attempt)
    ]
    assert found == [
        (10, 1, 1, 0, None, True, False),
        (11, 0, 0, 0, None, True, True),
        (11, 1, 1, 1, None, False, True),
        (20, 0, None, None, 0, False, False),
    ]
