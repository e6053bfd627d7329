"""The checker catches what is wrong, and nothing else."""

from __future__ import annotations

import dataclasses
import random
import re
from collections.abc import Callable

import numpy as np
import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble
from boresight.gateware.microcode.emulator import Emulator
from boresight.gateware.schedule.allocate import Allocation, LiveRange, allocate
from boresight.gateware.schedule.check import _parameter_register, check_schedule
from boresight.gateware.schedule.search import schedule
from boresight.gateware.schedule.slots import Schedule, ScheduleError, Slot
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Link, Negate, Op, Program, Term, When
from tests.support.crowded_program import crowded_program
from tests.support.random_program import random_inputs, random_program

MACHINES = pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
Made = tuple[Schedule, Allocation]


def made(seed: int, machine: Machine, n_ops: int = 40) -> tuple[Program, Schedule, Allocation]:
    p = random_program(seed, n_ops=n_ops, n_inputs=6, n_states=4)
    s = schedule(p, machine, restarts=0)
    return p, s, allocate(s)


def changed(s: Schedule, old: Slot, **fields: object) -> Schedule:
    """``s`` with one slot changed."""
    new = dataclasses.replace(old, **fields)  # type: ignore[arg-type]
    slots = sorted((new if x is old else x for x in s.slots), key=lambda x: (x.cycle, x.lane))
    return dataclasses.replace(s, slots=tuple(slots))


def moved(s: Schedule, op: int, by: int) -> Schedule:
    """``s`` with one group moved in time."""
    slots = [dataclasses.replace(x, cycle=x.cycle + by) if x.op == op else x for x in s.slots]
    return dataclasses.replace(s, slots=tuple(sorted(slots, key=lambda x: (x.cycle, x.lane))))


def readdressed(a: Allocation, value: int, address: int) -> Allocation:
    """``a`` with one value in another register."""
    return dataclasses.replace(
        a,
        live_ranges=tuple(
            dataclasses.replace(t, address=address) if t.value == value else t
            for t in a.live_ranges
        ),
    )


def mutate(rng: random.Random, s: Schedule, a: Allocation) -> tuple[str, Schedule, Allocation]:
    """One random small change."""
    slot = rng.choice(s.slots)
    tenant: LiveRange = rng.choice(a.live_ranges)
    kind = rng.choice(
        (
            "slot",
            "group",
            "lane",
            "capture",
            "quarter",
            "swap",
            "operand",
            "mark",
            "register",
            "exchange",
            "get",
            "length",
            "drop",
            "term",
            "order",
        )
    )
    if kind == "slot":
        s = changed(s, slot, cycle=slot.cycle + rng.choice((-1, 1)))
    elif kind == "group" and slot.op is not None:
        s = moved(s, slot.op, rng.choice((-3, -2, -1, 1, 2)))
    elif kind == "lane":
        s = changed(s, slot, lane=1 - slot.lane)
    elif kind == "capture":
        name = rng.choice(("cap_index", "cap_flag", "cap_norm"))
        s = changed(s, slot, **{name: not getattr(slot, name)})
    elif kind == "quarter":
        s = changed(s, slot, quarter=not slot.quarter)
    elif kind == "swap":
        s = changed(s, slot, swap=not slot.swap)
    elif kind == "operand":
        s = changed(s, slot, a=rng.choice(s.slots).a)
    elif kind == "mark":
        name = rng.choice(("first", "last"))
        s = changed(s, slot, **{name: not getattr(slot, name)})
    elif kind == "register":
        a = readdressed(a, tenant.value, tenant.address + rng.choice((-1, 1)))
    elif kind == "exchange":
        other = rng.choice(a.live_ranges)
        a = readdressed(readdressed(a, tenant.value, other.address), other.value, tenant.address)
    elif kind == "get":
        k = rng.randrange(len(s.gets))
        gets = list(s.gets)
        gets[k] += rng.choice((-1, 1, 5))
        s = dataclasses.replace(s, gets=tuple(gets))
    elif kind == "length":
        s = dataclasses.replace(s, length=s.length + rng.choice((-2, -1)))
    elif kind == "drop":
        s = dataclasses.replace(s, slots=tuple(x for x in s.slots if x is not slot))
    elif kind == "term":
        s = changed(s, slot, term=rng.randrange(3))
    elif kind == "order":
        other = rng.choice(s.slots)
        s = changed(s, slot, cycle=other.cycle, lane=other.lane)
        s = changed(s, other, cycle=slot.cycle, lane=slot.lane)
    return kind, s, a


def works(p: Program, s: Schedule, a: Allocation, machine: Machine) -> bool:
    """Whether the assembled program computes what the interpreter does."""
    core, model = Emulator(machine, assemble(s, a)), Interpreter(p)
    for words in random_inputs(p, 8, 6):
        out, saturated = model.update(np.array(words)[:, None])
        if core.update(words).outputs != out[:, 0].tolist() or core.saturated != saturated[0]:
            return False
        core.saturated = False
    return True


@MACHINES
@pytest.mark.parametrize("seed", range(6))
def test_mutants_are_caught_or_harmless(machine: Machine, seed: int) -> None:
    """Whatever the checker lets pass still computes the program."""
    p, s, a = made(seed, machine)
    rng = random.Random(seed)
    caught = 0
    for _ in range(150):
        kind, s2, a2 = mutate(rng, s, a)
        if (s2, a2) == (s, a):
            continue
        try:
            check_schedule(p, s2, a2)
        except ScheduleError as error:
            assert str(error).startswith(p.name)
            assert "\n" not in str(error)
            caught += 1
        else:
            assert works(p, s2, a2, machine), kind
    assert caught > 60


@MACHINES
def test_mutants_of_crowded_registers_are_caught_or_harmless(machine: Machine) -> None:
    """The same where results live in the registers of next states."""
    p = crowded_program()
    s = schedule(p, machine, restarts=0)
    a = allocate(s)
    where, rng = a.addresses(), random.Random(1)
    nexts = [where[after] for _, after in s.program.states]
    results = [op.dest for op in p.ops if op.dest not in dict(s.program.states).values()]
    assert works(p, s, a, machine)
    caught = 0
    for _ in range(60):
        a2 = readdressed(a, rng.choice(results), rng.choice(nexts))
        if a2 == a:
            continue
        try:
            check_schedule(p, s, a2)
        except ScheduleError:
            caught += 1
        else:
            assert works(p, s, a2, machine)
    assert 20 < caught < 60
    # A state slot without an owner is no place for a result: its parity may be another program's.
    lost = where[p.states[0][0]] + len(nexts)
    rejected(p, s, readdressed(a, results[0], lost), r": v0 is on the wrong side of the state")


def rejected(p: Program, s: Schedule, a: Allocation, match: str) -> None:
    with pytest.raises(ScheduleError, match=match):
        check_schedule(p, s, a)


@MACHINES
def test_early_group(machine: Machine) -> None:
    """A group that starts a cycle before its operand lands: the message names op and cycle."""
    p, s, a = made(1, machine)
    lands = {op.dest: s.write_cycle(k) for k, op in enumerate(s.program.ops)}
    lands |= dict(zip(s.program.inputs, s.gets, strict=True))
    count = 0
    for slot in s.slots:
        tight = [v for v in (slot.a, slot.b) if v is not None and lands.get(v) == slot.cycle - 1]
        if slot.op is None or not tight:
            continue
        others = {(x.cycle, x.lane) for x in s.slots if x.op != slot.op}
        mine = [x for x in s.slots if x.op == slot.op]
        if any((x.cycle - 1, x.lane) in others or x.cycle < 1 for x in mine):
            continue
        count += 1
        with pytest.raises(ScheduleError, match=r"cycle \d+: op \w+(\.next)?: "):
            check_schedule(p, moved(s, slot.op, -1), a)
    assert count


def pick(s: Schedule, wanted: Callable[[Slot], bool]) -> Slot:
    return next(x for x in s.slots if wanted(x))


@MACHINES
def test_dropped_capture(machine: Machine) -> None:
    p, s, a = made(2, machine)
    for kind in ("index", "flag", "norm"):
        dropped = 0
        for slot in s.slots:
            if not getattr(slot, f"cap_{kind}") or slot.term is None:
                continue
            try:
                check_schedule(p, changed(s, slot, **{f"cap_{kind}": False}), a)
            except ScheduleError as error:
                dropped += f"wants the {kind} of" in str(error)
        assert (
            dropped
            or not any(getattr(x, f"cap_{kind}") and x.term is not None for x in s.slots)
            or kind == "index"
        )


@MACHINES
def test_an_index_that_serves_too_late(machine: Machine) -> None:
    p, s, a = made(2, machine)

    class Late(Machine):
        index_delay = machine.index_delay + 1  # type: ignore[assignment]

    late = Late(**{f.name: getattr(machine, f.name) for f in dataclasses.fields(machine)})
    rejected(p, dataclasses.replace(s, machine=late), a, r"wants the index of")


def waits(op: Op, negated: bool) -> bool:
    """Whether a flag decides the sign of a term, or whether it is added, and nothing else."""
    signs = any(t.negate in (Negate.IF, Negate.UNLESS) for t in op.terms)
    terms = any(t.when is not When.ALWAYS for t in op.terms)
    return (signs, terms) == (negated, not negated)


@MACHINES
@pytest.mark.parametrize("negated", [False, True])
@pytest.mark.parametrize("quarter", [False, True])
def test_a_flag_that_nothing_captures(machine: Machine, negated: bool, quarter: bool) -> None:
    """The message says what the flag must be of, and what there is in its place."""
    for seed in range(40):
        p, s, a = made(seed, machine)
        number = next(
            (
                k
                for k, op in enumerate(s.program.ops)
                if waits(op, negated) and op.flag_quarter == quarter
            ),
            None,
        )
        own = [x for x in s.slots if x.op == number and x.cap_flag]
        if number is not None and own:
            break
    op = s.program.ops[number]
    plus = " plus quarter" * quarter
    for slot in own:
        s = changed(s, slot, cap_flag=False)
    before = [x for x in s.slots if x.cap_flag and x.lane == own[0].lane and x.cycle < own[0].cycle]
    last = max(before, key=lambda x: x.cycle, default=None)
    got = "nothing" if last is None else p.values[last.a].name + " plus quarter" * last.quarter
    name = re.escape(p.values[op.flag].name)
    rejected(p, s, a, rf"wants the flag of {name}{plus}, the lane holds that of {got}$")


@MACHINES
def test_directed(machine: Machine) -> None:
    p, s, a = made(3, machine)
    ops = s.program.ops
    slot = pick(s, lambda x: x.term is not None)
    name = s.program.values[ops[slot.op or 0].dest].name
    rejected(
        p,
        dataclasses.replace(s, slots=tuple(x for x in s.slots if x.op != slot.op)),
        a,
        rf": op {name}: is missing$",
    )
    rejected(p, dataclasses.replace(s, slots=(*s.slots, slot)), a, r": two slots in lane \d$")
    rejected(p, dataclasses.replace(s, length=s.length - 1), a, r": is not finished in \d+ cycles")
    rejected(p, dataclasses.replace(s, source="0"), a, r"not that of this program$")
    rejected(p, dataclasses.replace(s, gets=s.gets[1:]), a, r": 5 gets for 6 inputs$")
    rejected(p, dataclasses.replace(s, gets=s.gets[::-1]), a, r": gets must start in cycle 0")
    emit = pick(s, lambda x: x.emit == 0)
    rejected(p, changed(s, emit, emit=1), a, r": emits must be every output once")
    rejected(p, changed(s, emit, a=(emit.a + 1) % len(s.program.values)), a, r": output 0 is ")
    tenant = next(t for t in a.live_ranges if s.program.values[t.value].kind is Kind.INPUT)
    states = [x for x, _ in s.program.states]
    where = a.addresses()
    after = s.program.states[0][1]
    rejected(p, s, readdressed(a, tenant.value, where[states[0]]), r"wrong side of the state")
    rejected(p, s, readdressed(a, states[0], where[after]), r"must differ in bit c alone$")
    rejected(p, s, dataclasses.replace(a, initial=a.initial[1:]), r"511 initial words")
    const = next(t for t in a.live_ranges if s.program.values[t.value].kind is Kind.CONST)
    rejected(p, s, readdressed(a, tenant.value, const.address), r"(overwritten|not in its bank)$")
    rejected(p, s, readdressed(a, const.value, where[after]), r"wrong side of the state")
    words = list(a.initial)
    words[const.address] ^= 1
    rejected(p, s, dataclasses.replace(a, initial=tuple(words)), r"must start with the word of")
    rejected(
        p,
        s,
        dataclasses.replace(a, live_ranges=tuple(t for t in a.live_ranges if t != tenant)),
        r"has no register|which is not in its bank",
    )


@MACHINES
def test_read_while_written(machine: Machine) -> None:
    """A register that gets another value in the very cycle in which its own is read for the last
    time: an emulator would still read the old word there, a block RAM need not."""
    p, s, a = made(5, machine)
    where, low = a.addresses(), s.program
    lands = {op.dest: s.write_cycle(k) for k, op in enumerate(low.ops)}
    lands |= dict(zip(low.inputs, s.gets, strict=True))
    states = {n for pair in low.states for n in pair}
    free = {n: cycle for n, cycle in lands.items() if n not in states}
    count = 0
    for slot in s.slots:
        for read in {slot.a, slot.b} & free.keys():
            for other, cycle in free.items():
                same_bank = where[other] // machine.bank_depth == where[read] // machine.bank_depth
                if other == read or cycle != slot.cycle or not same_bank:
                    continue
                try:
                    check_schedule(p, s, readdressed(a, other, where[read]))
                except ScheduleError as error:
                    count += f"cycle {cycle}: " in str(error) and str(error).endswith(
                        f"reads register {where[read]} of {low.values[read].name} "
                        "while it is written"
                    )
                else:
                    raise AssertionError("two values in one register at once")
    assert count > 3


@MACHINES
def test_wrong_shift(machine: Machine) -> None:
    """Illegal terms are found even if the schedule follows the program."""
    p, s, a = made(4, machine)
    ops = list(p.ops)
    t = ops[0].terms[0]
    ops[0] = dataclasses.replace(
        ops[0], terms=(dataclasses.replace(t, shift=32), *ops[0].terms[1:])
    )
    bad = dataclasses.replace(p, ops=tuple(ops))
    low = dataclasses.replace(s.program, ops=(*ops, *s.program.ops[len(ops) :]))
    rejected(
        bad,
        dataclasses.replace(s, program=low, source=bad.digest),
        a,
        r"shift must be 0 to 31, not 32$",
    )


@MACHINES
def test_false_copy(machine: Machine) -> None:
    p, s, a = next(
        x
        for x in (made(seed, machine) for seed in range(50))
        if len(x[1].program.ops) > len(x[0].ops)
        and (x[1].program.ops[len(x[0].ops)].terms[0].b or 0) < len(x[0].values)
    )
    added = len(p.ops)
    copy = s.program.ops[added]
    (t,) = copy.terms
    for terms in (
        (Term(t.a, t.b, t.shift - 1),),
        (Term(t.a, t.b, t.shift, negate=Negate.YES),),
        (Term(p.inputs[0], t.b, t.shift),),
        (Term(t.a, None, t.shift),),
        (t, t),
    ):
        wrong = dataclasses.replace(copy, terms=terms)
        low = dataclasses.replace(s.program, ops=(*p.ops, wrong, *s.program.ops[added + 1 :]))
        rejected(p, dataclasses.replace(s, program=low), a, r"has no separate next value$")
    # By what begins as the power of two and may be written.
    assert t.b is not None
    param = dataclasses.replace(s.program.values[t.b], kind=Kind.PARAM)
    p, low = (
        dataclasses.replace(x, values=(*x.values[: t.b], param, *x.values[t.b + 1 :]))
        for x in (p, s.program)
    )
    s = dataclasses.replace(s, program=low, source=p.digest)
    rejected(p, s, a, r"has no separate next value$")


@MACHINES
def test_next_values_of_their_own(machine: Machine) -> None:
    """Two states do not become one value, and no state becomes what no operation makes."""
    p, s, a = made(1, machine)
    (first, after), (second, _) = s.program.states[:2]
    name = p.values[second].name
    for target in (after, p.inputs[0]):
        q, low = (
            dataclasses.replace(x, states=((first, after), (second, target), *x.states[2:]))
            for x in (p, s.program)
        )
        plan = dataclasses.replace(s, program=low, source=q.digest)
        rejected(q, plan, a, rf": state {name} has no separate next value$")
    states = ((first, after), (second, p.inputs[0]), *p.states[2:])
    low = dataclasses.replace(s.program, states=states)
    rejected(p, dataclasses.replace(s, program=low), a, rf": state {name} has no separate next")


def other_values(p: Program) -> Program:
    n = next(n for n, v in enumerate(p.values) if v.kind in (Kind.PARAM, Kind.CONST, Kind.STATE))
    value = dataclasses.replace(p.values[n], initial=p.values[n].initial ^ 1)
    return dataclasses.replace(p, values=(*p.values[:n], value, *p.values[n + 1 :]))


def other_ops(p: Program) -> Program:
    (term, *terms), ops = p.ops[0].terms, p.ops[1:]
    changed = dataclasses.replace(term, shift=term.shift ^ 1)
    return dataclasses.replace(
        p, ops=(dataclasses.replace(p.ops[0], terms=(changed, *terms)), *ops)
    )


@pytest.mark.parametrize(
    "other",
    [
        other_values,
        other_ops,
        lambda p: dataclasses.replace(p, inputs=p.inputs[::-1]),
        lambda p: dataclasses.replace(p, outputs=p.outputs[::-1]),
        lambda p: dataclasses.replace(p, table_memory=(*p.table_memory, *[0] * 512)),
        lambda p: dataclasses.replace(p, arithmetic=dataclasses.replace(p.arithmetic, headroom=19)),
        lambda p: dataclasses.replace(p, states=p.states[:-1]),
        lambda p: dataclasses.replace(p, links=(Link(p.inputs[0], "other", "y", 0),)),
    ],
)
def test_schedule_of_another_program(other: Callable[[Program], Program]) -> None:
    """It differs in one thing, and says that it was made of this one; or does not say so."""
    p, s, a = made(1, CONFIGS["small"])
    assert len(p.states) == 4 and len(p.outputs) > 1
    q = other(p)
    assert q != p
    message = r": the schedule is not that of this program$"
    rejected(q, dataclasses.replace(s, source=q.digest), a, message)
    rejected(p, dataclasses.replace(s, source=q.digest), a, message)


@pytest.mark.parametrize(
    ("depth", "lanes", "number", "register"),
    [(256, 1, 200, 200), (256, 2, 47, 47), (256, 2, 48, 256), (512, 2, 95, 95), (512, 2, 99, 515)],
)
def test_the_registers_of_parameters(depth: int, lanes: int, number: int, register: int) -> None:
    """Those of a host's writes: so many of each bank but the last."""
    assert _parameter_register(depth, lanes, number) == register
