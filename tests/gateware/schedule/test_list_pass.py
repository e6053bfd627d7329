"""One pass: order, limits, styles."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.list_pass import list_pass
from boresight.gateware.schedule.priorities import paths
from boresight.gateware.schedule.problem import ListProblem, Style
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value, When
from tests.support.random_program import random_program


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
    found = {node: start for node, _, start, _ in attempt.groups}
    return [found[k] for k in range(1, len(ops))]


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
    assert first == [1 if hold else last_get + 1 - CONFIGS["small"].STAGE_WRITE - (terms - 1)]
