"""One pass of list scheduling: the problem, its order, limits and state."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import replace

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.list_pass import list_pass
from boresight.gateware.schedule.priorities import paths, slots_after
from boresight.gateware.schedule.problem import Attempt, ListProblem, Style
from boresight.gateware.schedule.slots import ScheduleError, Slot
from boresight.gateware.schedule.state import NOTHING, ListState
from boresight.gateware.schedule.state_quotas import state_quotas
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value, When
from tests.support.random_program import random_program

# -- one pass: order, limits, styles --------------------------------------------------------------


def problem(seed: int, machine: Machine, urgent: int = 2) -> ListProblem:
    p = with_copies(random_program(seed, n_ops=50, n_outputs=4))
    return ListProblem(p, machine, far=paths(p, machine, urgent), urgent=urgent)


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_limit_gives_up_only_when_it_is_missed(machine: Machine) -> None:
    """With its own score as the limit a pass comes through; with less it does not."""
    for seed in range(10):
        work = problem(seed, machine)
        flat = [0.0] * work.nodes
        free = list_pass(work, flat, Style())
        assert free is not None
        latency, length = free.score[:2]
        assert list_pass(work, flat, Style(), (latency, length)) == free
        assert list_pass(work, flat, Style(), (latency + 1, 0)) == free
        assert list_pass(work, flat, Style(), (latency - 1, length)) is None
        assert list_pass(work, flat, Style(), (latency, length - 1)) is None


@pytest.mark.parametrize(
    "style",
    [
        Style(patience=0.0),
        Style(hold=False),
        Style(reuse=0.0, keep=0.0, stay=0),
        Style(detour=3),
        Style(reuse=32.0, keep=8.0, stay=4),
    ],
)
def test_every_slot_once_whatever_the_style(style: Style) -> None:
    work = problem(3, CONFIGS["fast"])
    attempt = list_pass(work, [float(-k) for k in range(work.nodes)], style)
    assert attempt is not None
    slots = work.slots(attempt)
    assert len({(s.cycle, s.lane) for s in slots}) == len(slots)
    assert sorted((s.op, s.term) for s in slots if s.term is not None) == [
        (k, t) for k, op in enumerate(work.program.ops) for t in range(len(op.terms))
    ]
    assert [s.emit for s in slots if s.emit is not None] == [0, 1, 2, 3]


def starts(machine: Machine, lengths: tuple[int, ...], patience: float | None) -> list[int]:
    """First cycles of an urgent group and of long ones of these lengths.

    The urgent one is ready in cycle 8, when the result that decides about its term is there; the
    long ones from the beginning on, and less urgent by 50.
    """
    long = [Op(4 + k, (Term(0, 1, 31),) * n) for k, n in enumerate(lengths)]
    flagged = Op(3, (Term(0, 1, 31, when=When.IF),), flag=2)
    ops = (Op(2, (Term(0, 1, 31),)), flagged, *long)
    values = (
        Value("x", Kind.INPUT, 31, -1, 1, "test"),
        Value("p", Kind.PARAM, 31, -1, 1, "test", initial=1),
        *(Value(f"y{op.dest}", Kind.OP, 31, -1, 1, "test") for op in ops),
    )
    outputs = tuple(op.dest for op in ops[1:])
    names = tuple(f"y{n}" for n in outputs)
    program = Program("impatience", Arithmetic(), values, ops, (0,), outputs, names, (), ())
    work = ListProblem(program, machine, far=paths(program, machine, 1), urgent=1)
    priority = [100.0, 50.0, *[0.0] * len(long), *(-1.0 - k for k in range(len(outputs)))]
    attempt = list_pass(work, priority, Style(patience=patience))
    assert attempt is not None
    results = {node: start for node, _, start, _ in attempt.groups}
    return [results[k] for k in range(1, len(ops))]


@pytest.mark.parametrize("length, waits", [(2, False), (6, False), (7, True), (24, True)])
@pytest.mark.parametrize("patience", [None, 0.0, 49.0, 50.0, 80.0])
def test_a_long_group_waits_for_a_more_urgent_one(
    length: int, waits: bool, patience: float | None
) -> None:
    """If that one is ready before it ends, and more urgent by more than the patience."""
    urgent, long = starts(CONFIGS["small"], (length,), patience)
    if waits and patience is not None and patience < 50:
        assert (urgent, long) == (8, 10)
    else:
        assert (urgent, long) == (max(8, 2 + length), 2)


@pytest.mark.parametrize("patience", [None, 0.0])
def test_a_long_group_does_not_wait_where_another_lane_is_free(patience: float | None) -> None:
    fast = CONFIGS["fast"]
    urgent, long = starts(fast, (24,), patience)
    assert (urgent, long) == (8, 1)
    urgent, first, second = starts(fast, (24, 24), patience)
    assert first == 1
    assert (urgent == 8 < second) if patience == 0.0 else (second == 2 and urgent > 20)


P, STATE, X, FLAG, FIRST = 0, 1, 2, 3, 20  # values: a parameter, a state, inputs, the first result


def carried(
    terms: Sequence[Sequence[Term]],
    priority: dict[int, float],
    style: Style,
    *,
    config: str = "small",
    inputs: int = 2,
    outputs: int = 2,
    next_state: int | None = None,
    state_quota: tuple[int, ...] | None = None,
) -> tuple[list[int], list[int | None]]:
    """First cycles of the ops, and of each output, the first results, the op it leaves with.

    The priority of what is not named is below 0, the less the later.
    """
    ops = [Op(FIRST + k, tuple(each), flag=FLAG) for k, each in enumerate(terms)]
    values = (
        Value("p", Kind.PARAM, 31, -1, 1, "test", initial=1),
        Value("s", Kind.STATE, 31, -1, 1, "test"),
        *(Value(f"x{k}", Kind.INPUT, 31, -1, 1, "test") for k in range(FIRST - X)),
        *(Value(f"y{op.dest}", Kind.OP, 31, -1, 1, "test") for op in ops),
    )
    out = tuple(range(FIRST, FIRST + outputs))
    states = () if next_state is None else ((STATE, FIRST + next_state),)
    taken, names = tuple(range(X, X + inputs)), tuple(f"o{n}" for n in out)
    program = Program("carry", Arithmetic(), values, tuple(ops), taken, out, names, states, ())
    far = paths(program, CONFIGS[config], 1)
    work = ListProblem(program, CONFIGS[config], far=far, urgent=1, state_quota=state_quota)
    attempt = list_pass(work, [priority.get(k, -1.0 - k) for k in range(work.nodes)], style)
    assert attempt is not None
    slots = work.slots(attempt)
    first = {s.op: s.cycle for s in slots if s.op is not None and s.first}
    emits = {s.emit: s.op for s in slots if s.emit is not None}
    return [first[k] for k in range(len(ops))], [emits[k] for k in range(outputs)]


def by(value: int, when: When = When.ALWAYS) -> Term:
    """A value by the parameter."""
    return Term(value, P, 31, when=when)


@pytest.mark.parametrize("carry", [False, True])
def test_an_output_leaves_with_an_op_that_reads_it(carry: bool) -> None:
    """Though the op is the less urgent of both; with the more urgent one of two that read it."""
    terms = [[by(X)], [by(X)], [by(FIRST + 1)], [by(FIRST + 1)], [by(X)] * 12]
    priority = {0: 100.0, 1: 99.0, 2: 1.0, 3: 2.0, 4: 60.0, 5: 51.0, 6: 50.0}
    first, emits = carried(terms, priority, Style(carry=carry))
    free = first[4] + 12  # here all of them are ready
    assert emits == [None, 3 if carry else None]
    assert (first[3] - free, first[2] - free) == ((1, 2) if carry else (2, 3))


def test_an_output_waits_for_no_op_that_cannot_start_yet() -> None:
    """It awoke a cycle early, in case that its flag takes a slot; but the lane holds the flag."""
    flagged = [by(FIRST + 1), by(FIRST + 2, When.IF)]
    terms = [[by(X), by(FLAG, When.IF)], [by(X)], [by(X), by(X)], flagged]
    priority = {0: 100.0, 1: 90.0, 2: 80.0, 3: 0.0, 4: 99.0, 5: 60.0}
    first, emits = carried(terms, priority, Style(carry=True), outputs=3)
    ready = first[2] + 1 + CONFIGS["small"].latency
    assert first[3] == ready - 1 and emits == [None, None, 3]


@pytest.mark.parametrize("room, carrier", [((1, 1), 1), ((0, 1), None)])
def test_an_output_leaves_with_no_state_that_the_lane_has_no_room_for(
    room: tuple[int, int], carrier: int | None
) -> None:
    first, emits = carried(
        [[by(X)], [by(FIRST)]],
        {0: 100.0, 1: 0.0, 2: 50.0},
        Style(carry=True),
        config="fast",
        next_state=1,
        state_quota=room,
    )
    assert first[1] == first[0] + CONFIGS["fast"].latency and emits[0] == carrier


def test_a_state_that_no_lane_has_room_for_is_placed_nowhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(CONFIGS, "short", replace(CONFIGS["small"], rom_words=64))
    with pytest.raises(ScheduleError, match=r"^carry: no schedule within 512 cycles$"):
        carried([[by(X)]], {}, Style(), config="short", next_state=0, state_quota=(0,), outputs=1)


@pytest.mark.parametrize("patience, carrier", [(None, 3), (0.0, None)])
def test_an_output_leaves_with_no_op_that_is_in_the_way(
    patience: float | None, carrier: int | None
) -> None:
    """Of one that is more urgent and ready a cycle later."""
    flagged = [by(X), by(FLAG, When.IF)]
    terms = [flagged, [by(X)], [by(FIRST + 1, When.IF)], [by(FIRST)] * 12]
    priority = {0: 100.0, 1: 99.0, 2: 90.0, 3: 0.0, 4: 95.0}
    first, emits = carried(terms, priority, Style(carry=True, patience=patience), outputs=1)
    ready = first[0] + 1 + CONFIGS["small"].latency
    assert emits == [carrier]
    assert first[2:] == ([ready + 12, ready] if carrier else [ready + 1, ready + 2])


@pytest.mark.parametrize("inputs, carrier", [(10, 9), (11, None)])
def test_an_output_leaves_with_no_op_whose_result_would_meet_an_input(
    inputs: int, carrier: int | None
) -> None:
    """The other lane relies on the last input: it cannot come later.

    Four results have pushed inputs back, to 11 and later; between them is the output's turn.
    """
    terms = [*[[by(X)]] * 8, [by(X + k) for k in range(inputs)], [by(FIRST)]]
    priority = {**{k: 100.0 - k for k in range(8)}, 8: 50.0, 9: 0.0, 10: 60.0}
    style = Style(carry=True)
    first, emits = carried(terms, priority, style, config="fast", inputs=inputs, outputs=1)
    assert first[8] == 5 and emits == [carrier] and (first[9] == 8) == (carrier is not None)


@pytest.mark.parametrize("terms", [1, 3])
@pytest.mark.parametrize("hold", [False, True])
def test_results_push_inputs_back_only_where_they_may(hold: bool, terms: int) -> None:
    """Else one waits until it is written behind the last of them."""
    first, _ = carried([[by(X)] * terms], {0: 1.0}, Style(hold=hold), inputs=12, outputs=1)
    last_get = 11
    assert first == [1 if hold else last_get + 1 - CONFIGS["small"].stages.write - (terms - 1)]


def test_the_other_lane_writes_whenever_it_will() -> None:
    first, _ = carried([[by(X)]], {0: 1.0}, Style(hold=False), config="fast", inputs=12, outputs=1)
    assert first == [1]


# -- the graph that list scheduling works on, and how a pass's groups become slots ----------------

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
def problem_problem(request: pytest.FixtureRequest) -> ListProblem:
    return ListProblem(PROGRAM, request.param, far=paths(PROGRAM, request.param, 1), urgent=1)


def test_ops_then_emits_each_after_what_it_reads(problem_problem: ListProblem) -> None:
    """A flag is read as an operand is; emits keep the order of the stream, whatever they show."""
    assert (problem_problem.n_ops, problem_problem.nodes) == (3, 6)
    assert problem_problem.producers == [[], [0], [0], [1], [0, 3], [4]]
    assert problem_problem.consumers == [[1, 2, 4], [3], [], [4], [5], []]
    assert problem_problem.waits == [len(before) for before in problem_problem.producers]
    assert problem_problem.makes_state == [False, False, True]


def test_room_for_states(problem_problem: ListProblem) -> None:
    machine = problem_problem.machine
    assert problem_problem.state_quota == (128 // machine.lanes,) * machine.lanes
    far = paths(PROGRAM, machine, 1)
    assert ListProblem(PROGRAM, machine, far=far, urgent=1, state_quota=[5]).state_quota == (5,)


def test_who_could_capture_for_whom(problem_problem: ListProblem) -> None:
    """Op 1 reads the value that is op 2's flag: it could capture its sign."""
    assert problem_problem.keys == [
        (None, None, None),
        (None, None, None),
        (None, (3, False), None),
    ]
    assert problem_problem.givers == {(1, (3, False)): [1]}


def test_ways_to_lay_out_a_node_are_found_once(problem_problem: ListProblem) -> None:
    need = problem_problem.needs[2]
    result = problem_problem.arranged(2, need)
    assert result and problem_problem.arranged(2, need) is result
    assert problem_problem.arranged(2, (False, False, False)) != result
    (emit,) = problem_problem.arranged(5, (False, False, False))
    assert emit.slots == (Slot(0, 0, 0, emit=2),) and emit.before == ()


def test_groups_as_slots(problem_problem: ListProblem) -> None:
    two = (Slot(0, 0, 3, 3, op=1, term=0), Slot(0, 0, 2, 1, op=1, term=1))
    slots = (Slot(0, 0, 0, 1, op=0, term=0),)
    emit = (Slot(0, 0, 4, emit=0),)
    attempt = Attempt(
        (0, 0, 0, 0), ((1, 1, 10, two), (3, 0, 20, emit), (0, 0, 11, slots)), (0,), 30
    )
    results = [
        (s.cycle, s.lane, s.op, s.term, s.emit, s.first, s.last)
        for s in problem_problem.slots(attempt)
    ]
    assert results == [
        (10, 1, 1, 0, None, True, False),
        (11, 0, 0, 0, None, True, True),
        (11, 1, 1, 1, None, False, True),
        (20, 0, None, None, 0, False, False),
    ]


# -- longest paths and lower bounds of small programs ---------------------------------------------


def chain(*ops: Op, outputs: tuple[int, ...]) -> Program:
    kinds = [Kind.INPUT, Kind.PARAM] + [Kind.OP] * len(ops)
    values = tuple(Value(f"x{k}", kind, 31, -1, 1, "test") for k, kind in enumerate(kinds))
    return Program(
        "chain",
        Arithmetic(),
        values,
        ops,
        (0,),
        outputs,
        tuple(f"o{k}" for k in range(len(outputs))),
        (),
        (),
    )


def test_chain() -> None:
    """Input in cycle 0, ops end in 1, 8, 16 (two slots wait for the second), emit 23, counted."""
    p = chain(
        Op(2, (Term(0, 1, 23),)),
        Op(3, (Term(2, 1, 23),)),
        Op(4, (Term(3, 1, 23), Term(3, 3, 23), Term(1, 1, 23))),
        outputs=(4,),
    )
    far = paths(p, CONFIGS["fast"], 1)
    assert far.urgent == (22, 15, 7, 0)
    assert far.slots == (1, 1, 3, 1)
    assert far.latency_bound == 1 + 22 + 2
    assert far.length_bound == 25


def test_not_urgent() -> None:
    p = chain(Op(2, (Term(0, 1, 23),)), Op(3, (Term(0, 1, 23),)), outputs=(2, 3))
    far = paths(p, CONFIGS["fast"], 1)
    assert far.urgent == (7, None, 0, None)
    assert far.total == (10, 9, 3, 2)


def test_slots_after() -> None:
    table = Op(9, (Term(0, None, 23, 0), Term(1, None, 23, 1)), index=1, table=0)
    assert [slots_after(table, v) for v in (0, 1)] == [1, 3]
    choice = Op(
        9, (Term(0, 1, 23, when=When.IF), Term(1, 1, 23, when=When.UNLESS), Term(2, 2, 23)), flag=3
    )
    assert [slots_after(choice, v) for v in (0, 1, 2, 3)] == [1, 2, 1, 3]
    scaled = Op(9, (Term(0, 1, 23, scale=Scale.FULL),), norm=0)
    assert [slots_after(scaled, v) for v in (0, 1)] == [1, 1]


# --------------------------------------------------------------------------------------------------
# what follows from what a pass has placed: gets out of the way, earliest starts, the score


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


LOOK_UP = Op(5, (Term(1, 3, 31), Term(2, None, 31, 0)), index=0, table=0)


def test_a_captured_index_serves_later() -> None:
    """From the cycle in which a slot may look up: its group begins so many cycles before."""
    state = state_of(by_hand((Op(4, (Term(0, 3, 31),)), LOOK_UP), inputs=3))
    state.index_from = [10]
    own = (True, False, False)
    fit = state.fit(1, NOTHING)[0]
    assert [state.may_look_up(t, 0, NOTHING, fit) for t in (8, 9, 10)] == [False, True, True]
    assert state.may_look_up(0, 0, own, state.fit(1, own)[0])
    assert state.may_look_up(0, 0, NOTHING, state.fit(0, NOTHING)[0])  # looks nothing up


def test_what_a_placed_group_leaves() -> None:
    """The last input that it relies on, its captures, one state less that its lane may compute."""
    program = by_hand((Op(4, (Term(0, 3, 31),)), LOOK_UP), inputs=3)
    state = state_of(dataclasses.replace(program, states=((3, 5),)))
    state.awake, state.asleep = [(0.0, 1)], []
    room = state.state_quota[0]
    own = (True, False, False)
    fit = state.fit(1, own)[0]
    capture = next(i for i, s in enumerate(fit[2].ordered(fit[3])) if s.cap_index)
    state.place(20, 1, 0, fit, None)
    assert state.horizon == 2 and state.state_quota == [room - 1]
    assert state.index_from == [20 + capture + state.p.index_delay]
    assert state.held == [[(0, False), None, None]]


@pytest.mark.parametrize("get", [False, True])
def test_an_output_leaves_in_no_cycle_of_an_input(get: bool) -> None:
    program = by_hand((Op(6, (Term(0, 5, 31),)), Op(7, (Term(6, 5, 31),) * 2)), inputs=5)
    state = state_of(program)
    slots = [Slot(0, 0, 5, 5, op=1, term=0), Slot(0, 0, 6, 5, op=1, term=1)]
    state.gets = [20 + 1 + state.read if get else 20 + 1 - state.read]
    assert [s.emit for s in state.ride(20, slots)] == [None, None if get else 0]


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
        out = machine.stages.read + 1
        words = [s.cycle + out for k in range(4) for s in slots if s.emit == k]
        written = [s.cycle + machine.stages.write + 1 for s in slots if s.last]
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


def test_the_shortest_program_lasts_until_its_first_word_is_fetched_again() -> None:
    """Its output, a parameter, has left before."""
    program = dataclasses.replace(by_hand((), inputs=1), outputs=(1,), output_names=("p",))
    attempt = list_pass(state_of(program).p, [0.0], Style())
    assert attempt is not None
    assert attempt.score[0] == CONFIGS["small"].prefetch
    assert attempt.length == CONFIGS["small"].prefetch + 1


# -- shares of the state registers ----------------------------------------------------------------

STATE_ROOMS_PROGRAM = random_program(1, n_ops=1, n_states=1)


def programs(*counts: int):
    return [replace(STATE_ROOMS_PROGRAM, states=STATE_ROOMS_PROGRAM.states * n) for n in counts]


@pytest.mark.parametrize("config", sorted(CONFIGS))
@pytest.mark.parametrize(
    "counts",
    [
        (1,),
        (128,),
        (127,),
        (0, 0),
        (1, 1, 1),
        (16, 20, 45, 47),
        (16, 15, 39, 44),
        (1, 126, 1),
        (64, 63),
        (3, 0, 5, 7, 9),
    ],
)
def test_everybody_finds_room(config: str, counts: tuple[int, ...]) -> None:
    machine = CONFIGS[config]
    rooms = state_quotas(programs(*counts), machine)
    assert len(rooms) == len(counts)
    for room, count in zip(rooms, counts, strict=True):
        assert len(room) == machine.lanes and sum(room) >= count
        assert max(room) - min(room) <= 1
    for lane in range(machine.lanes):
        assert sum(room[lane] for room in rooms) <= machine.state_slots


def test_a_single_program_has_it_all() -> None:
    assert state_quotas(programs(16), CONFIGS["fast"]) == [(64, 64)]
    assert state_quotas(programs(16), CONFIGS["small"]) == [(128,)]


def test_too_many() -> None:
    name = STATE_ROOMS_PROGRAM.name
    with pytest.raises(
        ScheduleError,
        match=rf"^{name} 100, {name} 29: 129 states, the small machine has "
        r"room for 128; config small-1024 has more$",
    ):
        state_quotas(programs(100, 29), CONFIGS["small"])
