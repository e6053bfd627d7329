"""One pass: order, limits, styles."""

from __future__ import annotations

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
