"""Where the words of records come from, by the names of inputs."""

from dataclasses import replace

import pytest

from boresight.gateware.system.feed import (
    HELD,
    PLACES,
    REGISTERS,
    ZERO,
    Fed,
    Feed,
    feed_of,
    reset_word,
)
from boresight.model.declarations import Input, Output
from boresight.model.estimator import Estimator


def program(*inputs: Input, name: str = "sums"):
    """A program with these inputs."""

    class Sums(Estimator):
        outputs = (Output("sum"),)

        def step(self, x, u, p):
            return {}, {"sum": sum(1.0 * getattr(u, i.name) for i in inputs)}

    Sums.name = name
    made = Sums()
    made.inputs = inputs
    return made.compile()


def test_names_in_any_order() -> None:
    made = program(
        Input("az", -160.0, 160.0),
        Input("my", -200.0, 200.0, missing=0.0),
        Input("dt", 0.0, 0.1),
        Input("gx", -40.0, 40.0),
    )
    assert feed_of([made]) == Feed(((Fed(5), Fed(9, ZERO, field=True), Fed(6), Fed(0)),))
    assert not feed_of([made]).wide


def test_a_field_between_two_lines() -> None:
    held = program(Input("mx", -200.0, 200.0, missing="hold"))
    feed = feed_of([held])
    assert feed.records == ((Fed(PLACES["mx"]),),) and feed.holds and feed.wide
    other = program(Input("mx", -200.0, 200.0, missing=50.0))
    feed = feed_of([other])
    assert feed.constants == (50 << 23,) and not feed.holds and feed.wide
    assert feed.records == ((Fed(PLACES["mx"], HELD, field=True),),)


def test_flags() -> None:
    made = program(
        Input("mx", -200.0, 200.0, missing=0.0),
        Input("x", -1.0, 1.0),
        Input("mx_new", 0.0, 1.0, valid_of="mx"),
        Input("x_new", 0.0, 1.0, valid_of="x"),
        Input("both", 0.0, 1.0, valid_of=("mx", "x")),
        Input("gx_new", 0.0, 3.0, valid_of="gx"),
        Input("gx", -40.0, 40.0),
    )
    feed = feed_of([made])
    # 1.0 has 30 fraction bits in [0, 1], 29 in [0, 3].
    assert feed.constants == (1 << 30, 1 << 29)
    assert feed.records[0][2:6] == (
        Fed(HELD, ZERO, field=True),
        Fed(HELD, ZERO, registers=True),
        Fed(HELD, ZERO, field=True, registers=True),
        Fed(HELD + 1),
    )


def test_registers_are_shared_by_name() -> None:
    one = program(Input("x", -1.0, 1.0), Input("y", 2.0, 3.0), name="one")
    two = program(Input("z", -3.0, -1.5), Input("x", -1.0, 1.0), name="two")
    feed = feed_of([one, two])
    assert list(feed.registers) == ["x", "y", "z"]
    assert feed.records[1] == (Fed(REGISTERS + 2), Fed(REGISTERS))
    assert [reset_word(v) / 2**v.frac for v in feed.registers.values()] == [0.0, 2.0, -1.5]
    wrong = replace(two.values[two.inputs[1]], frac=20)
    values = tuple(wrong if v.name == "x" else v for v in two.values)
    with pytest.raises(ValueError, match=r"^register x must have one format"):
        feed_of([one, replace(two, values=values)])


def test_room() -> None:
    many = [program(*(Input(f"x{k}_{n}", -1.0, 1.0) for n in range(11))) for k in range(3)]
    with pytest.raises(ValueError, match=r"^registers must be 32 or fewer"):
        feed_of(many)
    constants = [
        program(Input("mx", -200.0, 200.0, missing=1.0 + k), name=f"c{k}") for k in range(9)
    ]
    assert len(feed_of(constants[:8]).constants) == 8
    with pytest.raises(ValueError, match=r"^constants must be 8 or fewer"):
        feed_of(constants)
