"""The listing shows what the bits say."""

from __future__ import annotations

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble, encode
from boresight.gateware.microcode.listing import actions, listing
from boresight.gateware.schedule.allocate import Allocation, LiveRange, allocate
from boresight.gateware.schedule.scheduler import schedule
from boresight.gateware.schedule.slots import Schedule
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Negate, Op, Program, Term, Value
from tests.support.random_program import random_program

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
LENGTH = 16
VALUES = tuple(Value(n, Kind.PARAM, 31, -1, 1, "test") for n in ("x", "y", "gain", "far"))
PROGRAM = Program("text", Arithmetic(), VALUES, (), (), (), (), (), ())
#: Register 3 holds x in the cycles 1 to 4, then y from 6 to 9.
HELD = (LiveRange(0, 3, 1, 4), LiveRange(1, 3, 6, 9), LiveRange(2, 5, 0, LENGTH - 1))
FAR = LiveRange(3, FAST.bank_depth + 7, 6, LENGTH - 1)


def told(machine: Machine, cycle: int, **fields: int) -> list[tuple[str, ...]]:
    """Actions of a program with one slot, issued in a cycle; in ROM each field has its stage."""
    stage = {f.name: f.stage for f in machine.fields}
    words: list[dict[str, int]] = [{} for _ in range(LENGTH)]
    for name, value in fields.items():
        words[cycle + stage[name]][name] = value
    rom = [encode(machine, w) for w in words]
    plan = Schedule(PROGRAM, "0", machine, (), (), LENGTH, 0)
    held = HELD if machine is SMALL else (*HELD, FAR)
    return actions(rom, plan, Allocation(held, ()))


PRODUCT = {"a_addr0": 3, "b_addr0": 5, "when0": 1}


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({}, ""),
        ({"a_addr0": 3}, ""),
        (PRODUCT, " +x * gain >> 0"),
        (PRODUCT | {"first0": 1, "shift0": 23}, "[+x * gain >> 23"),
        (PRODUCT | {"we0": 1, "neg0": 1}, " -x * gain >> 0 ]"),
        (PRODUCT | {"neg_flag0": 1, "scale0": 1}, " -if x * gain >> 0-n"),
        (PRODUCT | {"neg0": 1, "neg_flag0": 1, "scale0": 2}, " -unless x * gain >> 0-(n&~1)"),
        (PRODUCT | {"when_flag0": 1, "scale0": 3}, " +x * gain >> 0-(n>>1) unless"),
        (PRODUCT | {"when0": 0, "when_flag0": 1}, " +x * gain >> 0 if"),
        (PRODUCT | {"frac_a0": 1}, " +frac(x) * gain >> 0"),
        (PRODUCT | {"frac_b0": 1}, " +x * frac(gain) >> 0"),
        (PRODUCT | {"table0": 1, "b_addr0": 2 << 2 | 3}, " +x * table2[3] >> 0"),
        (PRODUCT | {"table0": 1, "b_addr0": 1 << 2 | 0}, " +x * table1[0] >> 0"),
        (PRODUCT | {"cap_index0": 1, "quarter0": 1}, " +x * gain >> 0 ?index+1/4"),
        (PRODUCT | {"cap_flag0": 1, "cap_norm0": 1}, " +x * gain >> 0 ?flag,norm"),
        ({"a_addr0": 3, "cap_norm0": 1}, " x ?norm"),
        ({"a_addr0": 3, "cap_flag0": 1, "first0": 1, "we0": 1}, "[x ?flag ]"),
        ({"a_addr0": 3, "emit": 1}, " emit x"),
    ],
)
def test_what_a_slot_does(fields: dict[str, int], text: str) -> None:
    assert told(SMALL, 2, **fields)[2][0] == text


@pytest.mark.parametrize(
    ("cycle", "name"), [(0, "r3"), (1, "x"), (4, "x"), (5, "r3"), (6, "y"), (9, "y"), (10, "r3")]
)
def test_a_register_has_the_name_of_what_it_holds_in_that_cycle(cycle: int, name: str) -> None:
    assert told(SMALL, cycle, a_addr0=3, cap_flag0=1)[cycle][0] == f" {name} ?flag"


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({}, ""),
        ({"get": 1, "dest0": 3}, "get y"),
        ({"get": 1, "get_last": 1, "dest0": 4}, "get r4 (last)"),
        ({"we0": 1, "wrap0": 1, "sticky0": 1, "dest0": 3}, "y = wrap0"),
        ({"we0": 1, "sticky0": 1, "dest0": 3}, "y = sat0"),
        ({"we0": 1, "dest0": 3}, "y = clip0"),
        ({"we1": 1, "dest1": 7}, "far = clip1"),
        (
            {"we0": 1, "dest0": 3, "we1": 1, "sticky1": 1, "dest1": 8},
            f"y = clip0, r{FAST.bank_depth + 8} = sat1",
        ),
        ({"get": 1, "dest0": 3, "we1": 1, "dest1": 7}, "get y, far = clip1"),
        ({"emit": 1, "home": 1}, "out, home"),
        ({"emit": 1, "emit_last": 1}, "out (last)"),
    ],
)
def test_what_happens_in_a_cycle(fields: dict[str, int], text: str) -> None:
    """A value is written in the cycle before the first in which its register holds it."""
    words: list[dict[str, int]] = [{} for _ in range(LENGTH)]
    words[5] = fields
    rom = [encode(FAST, w) for w in words]
    plan = Schedule(PROGRAM, "0", FAST, (), (), LENGTH, 0)
    assert actions(rom, plan, Allocation((*HELD, FAR), ()))[5][-1] == text


def test_a_lane_reads_all_banks() -> None:
    rows = told(FAST, 6, a_addr1=FAST.bank_depth + 7, b_addr1=3, when1=1)
    assert rows[6] == ("", " +far * y >> 0", "")


def test_text() -> None:
    values = (
        Value("x", Kind.INPUT, 31, -1, 1, "test"),
        Value("gain", Kind.PARAM, 31, -1, 1, "test"),
        Value("y", Kind.OP, 31, -1, 1, "test"),
    )
    p = Program(
        "text",
        Arithmetic(),
        values,
        (Op(2, (Term(0, 1, 23, negate=Negate.IF),), flag=0),),
        (0,),
        (2,),
        ("y",),
        (),
        (),
    )
    s = schedule(p, CONFIGS["small"])
    a = allocate(s)
    lines = listing(assemble(s, a).rom, s, a).splitlines()
    assert lines[:3] == [
        "cycle  lane 0                      | written, streams",
        "    0                              | get x (last)",
        "    1  [-if x * gain >> 23 ?flag ] |",
    ]
    assert lines[8].split("|")[1] == " y = sat0"
    assert lines[9].split("|")[0].split() == ["8", "emit", "y"]
    assert lines[10].split("|")[1] == " out (last), home"
    assert len(lines) == s.length + 1


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_every_register_has_a_name(machine: Machine) -> None:
    for seed in range(6):
        s = schedule(random_program(seed), machine)
        a = allocate(s)
        text = listing(assemble(s, a).rom, s, a)
        assert " r" not in text
        assert text.count("[") - text.count("table") == len(s.program.ops)
