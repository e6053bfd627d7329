"""Bit-wise tables: primitive and function agree for every function of the core."""

import pytest

import boresight.gateware.engine.lane as lane
import boresight.gateware.engine.sequencer as sequencer
from boresight.gateware.engine.bitwise import Bitwise, choose, multiplex

FUNCTIONS = [
    (choose, 3),
    (multiplex, 6),
    (lane._differs, 6),
    (lane._differs, 3),
    (lane._line0, 3),
    (lane._line1, 3),
    (lane._result_low, 5),
    (lane._result_low, 6),
    (lane._result_sign, 5),
    (lane._result_sign, 6),
    (sequencer._blocked, 4),
    (sequencer._enabled, 5),
    (sequencer._misframed, 5),
    (sequencer._written, 6),
    (sequencer._written_only, 6),
    (sequencer._completed, 6),
]


@pytest.mark.parametrize(
    "function, inputs", FUNCTIONS, ids=[f"{f.__name__.strip('_')}{n}" for f, n in FUNCTIONS]
)
def test_behaviour_equals_table(function, inputs, simulate) -> None:
    dut = Bitwise(function=function, inputs=inputs, width=1 << inputs)

    async def bench(ctx):
        # Bit n of the words is row n of the table.
        for k in range(inputs):
            ctx.set(dut.i[k], sum((n >> k & 1) << n for n in range(1 << inputs)))
        assert ctx.get(dut.o) == dut.table

    simulate(dut, bench)


def test_primitive_equals_behaviour(proves_equal) -> None:
    def make(function=multiplex):
        return Bitwise(function=function, inputs=6, width=3)

    assert proves_equal(make(), make())
    assert not proves_equal(make(), make(lane._result_low))


def test_multiplex() -> None:
    words = (0b0011, 0b0101, 0b1001, 0b1110)
    for select, word in enumerate(words):
        assert multiplex(*words, -(select & 1), -(select >> 1)) == word


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"inputs": 7}, r"^inputs must be an integer from 2 to 6, not 7$"),
        ({"inputs": 3, "width": 0}, r"^width must be a positive integer, not 0$"),
    ],
)
def test_parameters_are_checked(arguments, message) -> None:
    with pytest.raises(ValueError, match=message):
        Bitwise(function=choose, **arguments)
