"""The listing shows what the bits say."""

from __future__ import annotations

import pytest

from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble
from boresight.gateware.microcode.listing import listing
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
    lines = listing(assemble(s, a).program(0), s, a).splitlines()
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
        text = listing(assemble(s, a).program(0), s, a)
        assert " r" not in text
        assert text.count("[") - text.count("table") == len(s.program.ops)
