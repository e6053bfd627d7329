"""Schedules of random and of known programs."""

from __future__ import annotations

import dataclasses
import math
import random

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule import scheduler
from boresight.gateware.schedule.allocate import allocate
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.deviates import Deviates
from boresight.gateware.schedule.priorities import paths
from boresight.gateware.schedule.problem import Attempt, ListProblem
from boresight.gateware.schedule.scheduler import Schedule, ScheduleError, schedule
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Term, Value, When
from tests.support.random_program import random_program

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
ONE = 1 << 30


def program(
    ops: list[Op],
    outputs: list[int],
    *,
    inputs: int = 1,
    states: tuple[tuple[int, int], ...] = (),
    more: tuple[Value, ...] = (),
) -> Program:
    """Values: inputs, then the constant one, then ``more``, then one for each op."""
    values = [Value(f"in{k}", Kind.INPUT, 31, -1, 1, "test") for k in range(inputs)]
    values += [Value("one", Kind.CONST, 30, 1, 1, "test", initial=ONE), *more]
    values += [Value(f"v{k}", Kind.OP, 31, -1, 1, "test") for k in range(len(ops))]
    return Program(
        "test",
        Arithmetic(),
        tuple(values),
        tuple(ops),
        tuple(range(inputs)),
        tuple(outputs),
        tuple(f"o{k}" for k in outputs),
        states,
        tuple(k % 1000 for k in range(1536)),
    )


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("seed", range(24))
def test_checker_passes(config: str, seed: int) -> None:
    p = random_program(seed, n_ops=5 + 4 * seed, recent=seed % 5 / 4)
    machine = dataclasses.replace(CONFIGS[config], depth=Machine.DEPTHS[seed % 5 - 1])
    s = schedule(p, machine, restarts=10, urgent=min(2, len(p.outputs)))
    allocate(s)


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_one_op(machine: Machine) -> None:
    """get in cycle 0, read in 1, written in 7, emitted at 8 + 1, counted: 10."""
    p = program([Op(2, (Term(0, 1, 22),))], [2])
    s = schedule(p, machine)
    assert s.latencies == (10,)
    assert s.length == s.interval == 10
    assert s.latency == 10


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_late_operand_comes_last(machine: Machine) -> None:
    """The slots on early operands hide behind the wait for the late one."""
    p = program(
        [Op(2, (Term(0, 1, 22),)), Op(3, (Term(2, 1, 22), Term(0, 0, 22), Term(0, 1, 22)))], [3]
    )
    s = schedule(p, machine)
    assert s.latencies == (17,)


def test_bundle_captures_once() -> None:
    """u, t, w and their sum: one capture, six slots and the emit."""
    f = {"fraction_a": True}
    p = program(
        [
            Op(2, (Term(0, 0, 23, fraction_a=True, fraction_b=True),), index=0),
            Op(3, (Term(1, None, 23, 2), Term(0, None, 23, 3, **f)), index=0, table=1),
            Op(4, (Term(1, None, 23, 0), Term(0, None, 23, 1, **f)), index=0, table=1),
            Op(5, (Term(4, 1, 22), Term(3, 2, 23))),
        ],
        [5],
    )
    s = schedule(p, SMALL)
    assert len(s.slots) == 8
    assert sum(slot.cap_index for slot in s.slots) == 1
    # u, t, w in 1..5; t u in 11, w in 12, read in 19, emitted in 20, counted.
    assert s.latency == 21


@pytest.mark.parametrize("quarter", [False, True])
def test_flag_rides_on_a_term(quarter: bool) -> None:
    """|x|: the term that is negated also shows the sign."""
    p = program([Op(2, (Term(1, 0, 22, negate=Negate.IF),), flag=0, flag_quarter=quarter)], [2])
    (slot, _) = schedule(p, FAST).slots
    assert (slot.a, slot.swap, slot.cap_flag, slot.quarter) == (0, True, True, quarter)


def test_flag_of_a_stranger_takes_a_slot() -> None:
    p = program(
        [Op(3, (Term(0, 2, 22, when=When.IF), Term(2, 2, 22, when=When.UNLESS)), flag=1)],
        [3],
        inputs=2,
    )
    s = schedule(p, SMALL)
    assert len(s.slots) == 4
    assert (s.slots[0].term, s.slots[0].a, s.slots[0].cap_flag) == (None, 1, True)


def test_flag_is_kept() -> None:
    """Two selections by the same flag in a row need one capture."""
    select = (Term(0, 2, 22, when=When.IF), Term(2, 2, 22, when=When.UNLESS))
    p = program([Op(3, select, flag=1), Op(4, select, Overflow.CLIP, flag=1)], [3, 4], inputs=2)
    assert len(schedule(p, SMALL).slots) == 7


def test_copies_for_states() -> None:
    """A state that stays, and one result for two states."""
    states = tuple(Value(f"s{k}", Kind.STATE, 31, -1, 1, "test") for k in range(3))
    p = program([Op(5, (Term(0, 1, 22),))], [2], states=((2, 2), (3, 5), (4, 5)), more=states)
    low = with_copies(p)
    assert [n for _, n in low.states] == [6, 5, 7]
    assert [low.values[n].name for n in (6, 7)] == ["s0.next", "s2.next"]
    s = schedule(p, FAST)
    allocate(s)


def test_small_fills_its_lane() -> None:
    """Bound by slots, one lane is busy all the time but for the last pipeline."""
    for seed in range(4):
        p = random_program(seed, n_ops=120, n_inputs=10, n_outputs=7, n_states=8, recent=0.2)
        s = schedule(p, SMALL, urgent=4, restarts=20)
        assert s.lane_use[0] > 0.96


def test_urgent_outputs_come_first() -> None:
    p = random_program(5, n_ops=100, n_inputs=8, n_outputs=8, n_states=4, recent=0.2)
    some, every = (schedule(p, SMALL, urgent=u, restarts=20) for u in (2, 8))
    assert some.latency <= 1.04 * every.latencies[1]
    assert every.latency <= 1.01 * some.latencies[7]


def test_nothing_is_urgent() -> None:
    p = random_program(5, n_ops=60)
    s = schedule(p, SMALL, urgent=0, restarts=20)
    allocate(s)
    assert s.latency == 0
    assert s.length <= schedule(p, SMALL, restarts=20).length


def test_emit_rides_on_a_term() -> None:
    """An output that an op reads leaves with that slot: no slot of its own."""
    p = program([Op(2, (Term(0, 1, 22),)), Op(3, (Term(1, 2, 22),))], [2, 3])
    s = schedule(p, SMALL)
    assert len(s.slots) == 3
    assert (s.slots[1].op, s.slots[1].emit, s.slots[1].a) == (1, 0, 2)
    allocate(s)


def test_late_gets_make_room() -> None:
    """A result of lane 0 may take the cycle of a get whose word no operation waits for."""
    p = program(
        [Op(21, (Term(0, 20, 22),)), Op(22, (Term(21, 20, 22), Term(19, 20, 22)))], [22], inputs=20
    )
    s = schedule(p, SMALL, urgent=0, restarts=50)
    allocate(s)
    assert s.length == 30


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_bounds_hold(machine: Machine) -> None:
    for seed in range(10):
        p = random_program(seed, n_ops=30)
        bound = paths(with_copies(p), machine, len(p.outputs))
        s = schedule(p, machine)
        assert bound.latency_bound <= s.latency
        assert bound.length_bound <= s.length


def test_same_arguments_same_schedule() -> None:
    p = random_program(7, n_ops=40)
    assert schedule(p, FAST, restarts=30) == schedule(p, FAST, restarts=30)


def test_json() -> None:
    s = schedule(random_program(9), FAST, restarts=0)
    assert Schedule.from_json(s.to_json(), FAST) == s
    with pytest.raises(ScheduleError, match=r"^machine must be 'fast', not 'small'$"):
        Schedule.from_json(s.to_json(), SMALL)


def test_errors() -> None:
    p = random_program(1, n_ops=30)
    with pytest.raises(
        ScheduleError,
        match=r"^random_1_32_30: program takes \d+ microwords or more, the "
        r"fast machine has 16; compute less in a sample$",
    ):
        schedule(p, dataclasses.replace(FAST, rom_words=16), restarts=0)
    crowd = random_program(1, n_ops=10, n_states=9)
    with pytest.raises(
        ScheduleError,
        match=r"^random_1_32_10: 9 states, the fast machine has room "
        r"for 8; config fast-1024 has more$",
    ):
        schedule(crowd, FAST, state_quota=(3, 5))
    with pytest.raises(ScheduleError, match=r"must have the same arithmetic"):
        schedule(p, dataclasses.replace(FAST, arithmetic=Arithmetic(24)))
    with pytest.raises(ValueError, match=r"^urgent must be 0 to \d+, not -1$"):
        schedule(p, FAST, urgent=-1)
    with pytest.raises(ValueError, match=r"^restarts must be 0 or more, not -1$"):
        schedule(p, FAST, restarts=-1)


def test_a_program_that_is_too_long_is_refused_before_the_search() -> None:
    """By its slots alone, with the last pipeline."""
    p = random_program(1, n_ops=30)
    with pytest.raises(ScheduleError, match=r"takes 72 microwords or more, the small machine"):
        schedule(p, dataclasses.replace(SMALL, rom_words=71))


def test_circle() -> None:
    p = program([Op(2, (Term(3, 1, 22),)), Op(3, (Term(2, 1, 22),))], [3])
    with pytest.raises(ScheduleError, match=r"^test: op v0 waits for itself"):
        schedule(p, FAST)


def test_styles_are_tried_before_priorities_are_disturbed(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def recorded(name: str) -> None:
        original = getattr(search, name)
        monkeypatch.setattr(search, name, lambda *a: made.append(name) or original(*a))

    recorded("_style")
    recorded("_disturb")
    schedule(random_program(5, n_ops=60), SMALL, restarts=40)
    first = made.index("_disturb")
    assert 0 < first < len(made) - 1 and set(made[:first]) == {"_style"}
    assert first == math.ceil(40 * search._STYLE_SHARE) and made.count("_disturb") == 40 - first


def test_passes_by_default(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer for longer programs."""
    p, made = random_program(5, n_ops=30), []
    nodes = len(with_copies(p).ops) + len(p.outputs)
    few = search._search
    monkeypatch.setattr(search, "_search", lambda a, n, rng: made.append(n) or few(a, 0, rng))
    for effort in (0, 20, 21, 300, 301):
        monkeypatch.setattr(search, "_EFFORT", effort * nodes)
        schedule(p, SMALL)
    assert made == [20, 20, 21, 300, 300]


def problem(n_ops: int = 8) -> ListProblem:
    p = with_copies(random_program(5, n_ops=n_ops, n_outputs=4, n_states=0))
    assert len(p.ops) == n_ops
    return ListProblem(p, SMALL, far=paths(p, SMALL, 4), urgent=4)


@pytest.mark.parametrize(
    ("above", "passes"), [((0, 0), 1), ((-1, 0), 1), ((0, 1), 6), ((1, 0), 6), ((1, -1), 6)]
)
def test_the_search_ends_where_nothing_is_better(
    monkeypatch: pytest.MonkeyPatch, above: tuple[int, int], passes: int
) -> None:
    """Else the last of what is no worse is taken, and a pass may give nothing."""
    given = problem()
    best = (given.far.latency_bound + above[0], given.far.length_bound + above[1])
    made: list[Attempt | None] = []

    def one(*_: object) -> Attempt | None:
        third = 1 if len(made) == 4 else 0
        made.append(Attempt((*best, third, 0), (), (), 0) if len(made) != 2 else None)
        return made[-1]

    monkeypatch.setattr(search, "list_pass", one)
    found = search._search(given, 5, random.Random(0))
    assert len(made) == passes and found is made[-1]


@pytest.mark.parametrize(("n_ops", "carries"), [(8, True), (9, False)])
def test_outputs_are_carried_where_they_are_many(
    monkeypatch: pytest.MonkeyPatch, n_ops: int, carries: bool
) -> None:
    seen, whole = set(), search.list_pass
    monkeypatch.setattr(search, "list_pass", lambda *a: seen.add(a[2].carry) or whole(*a))
    search._search(problem(n_ops), 9, random.Random(0))
    assert seen == {carries}


def test_disturbances_stay_the_same() -> None:
    """As the digests of schedules, with more draws than those take."""
    given, rng = problem(40), random.Random(1)
    deviates, hot = Deviates(rng), range(0, 40, 3)
    drawn = [search._disturb([0.0] * given.nodes, given, hot, rng, deviates) for _ in range(400)]
    moves = [x for trial in drawn for x in trial if x]
    assert (len(moves), round(math.fsum(map(abs, moves)), 6)) == (3677, 56689.215413)
