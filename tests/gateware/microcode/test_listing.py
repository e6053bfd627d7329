"""The listing shows what the bits say."""

from __future__ import annotations

import re

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble
from boresight.gateware.microcode.listing import actions
from boresight.gateware.schedule.allocate import allocate
from boresight.gateware.schedule.scheduler import schedule
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Negate, Op, Program, Term, Value
from tests.support.random_program import random_program

SMALL, FAST = CONFIGS["small"], CONFIGS["fast"]
#: Register 3 holds x in the cycles 1 to 4, then y from 6 to 9.


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
    rows = actions(assemble(s, a).program(0), s, a)
    assert rows[:2] == [("", "get x (last)"), ("[-if x * gain >> 23 ?flag ]", "")]
    assert rows[7][1] == "y = sat0" and rows[8][0].strip() == "emit y"
    assert rows[9][1] == "out (last), home" and len(rows) == s.length


@pytest.mark.parametrize("machine", CONFIGS.values(), ids=CONFIGS)
def test_every_register_has_a_name(machine: Machine) -> None:
    for seed in range(6):
        s = schedule(random_program(seed), machine)
        a = allocate(s)
        text = " ".join(" ".join(row) for row in actions(assemble(s, a).program(0), s, a))
        assert not re.search(r"\br\d", text)
        assert text.count("[") - text.count("table") == len(s.program.ops)
