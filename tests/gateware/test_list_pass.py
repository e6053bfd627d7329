"""One pass: order, limits, styles."""

from __future__ import annotations

import pytest

from boresight.gateware.copies import with_copies
from boresight.gateware.list_pass import list_pass
from boresight.gateware.list_problem import ListProblem, Style
from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.priorities import paths
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
