"""The plan of a core's programs, and where the words of their records come from."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from boresight.gateware.attitude.system.plan import (
    FRONT_NAMES,
    HELD,
    PLACES,
    REGISTERS,
    ZERO,
    Fed,
    Feed,
    feed_of,
    plan_of,
    reset_word,
)
from boresight.gateware.attitude.system.programs import system_core
from boresight.model.declarations import Input, Output
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator

# -- where the words of records come from, by the names of inputs ---------------------------------


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
    first = program(Input("x", -1.0, 1.0), Input("y", 2.0, 3.0), name="one")
    two = program(Input("z", -3.0, -1.5), Input("x", -1.0, 1.0), name="two")
    feed = feed_of([first, two])
    assert list(feed.registers) == ["x", "y", "z"]
    assert feed.records[1] == (Fed(REGISTERS + 2), Fed(REGISTERS))
    assert [reset_word(v) / 2**v.frac for v in feed.registers.values()] == [0.0, 2.0, -1.5]
    wrong = replace(two.values[two.inputs[1]], frac=20)
    values = tuple(wrong if v.name == "x" else v for v in two.values)
    with pytest.raises(ValueError, match=r"^register x must have one format"):
        feed_of([first, replace(two, values=values)])


# -- what the conductor is told of a core: refused when the programs do not fit together ----------


@pytest.fixture(scope="module")
def core():
    return system_core(["complementary"])


@pytest.fixture(scope="module")
def made(core):
    return [p.program for p in core.parts], [p.schedule for p in core.parts]


def planned(programs, schedules) -> Any:
    parts = zip(programs, schedules, strict=False)
    core = SimpleNamespace(parts=[SimpleNamespace(program=p, schedule=s) for p, s in parts])
    return plan_of(core)


def test_plan(core) -> None:
    plan = plan_of(core)
    assert plan.names == ("complementary", *FRONT_NAMES)
    assert (plan.filters, plan.inertial, plan.field, plan.compass) == (1, 1, 2, 3)
    assert plan.lengths == tuple(p.schedule.length for p in core.parts)
    assert (plan.word, plan.outputs, plan.count_bits) == (32, (8,), 16)
    assert not plan.feed.wide and not plan.early


def test_front_programs_must_be_the_last(made) -> None:
    programs, schedules = made
    for wrong in (programs[1:], programs[::-1], programs[:-1]):
        with pytest.raises(
            ValueError, match=r"^programs must be estimators, then calibrate_inertial"
        ):
            planned(wrong, schedules)


def change(program, number, **what):
    values = list(program.values)
    values[number] = replace(values[number], **what)
    return replace(program, values=tuple(values))


@pytest.mark.parametrize(
    "front, output, name", [(1, 0, "gx"), (1, 6, "dt"), (2, 1, "my"), (3, 2, "mz")]
)
def test_binary_points_must_be_the_filters(made, front: int, output: int, name: str) -> None:
    programs, schedules = list(made[0]), made[1]
    number = programs[front].outputs[output]
    programs[front] = change(programs[front], number, frac=programs[front].values[number].frac - 1)
    with pytest.raises(ValueError, match=rf"^input {name} of complementary must be fixed<32,"):
        planned(programs, schedules)


def test_an_unknown_name_is_a_register(made) -> None:
    programs, schedules = list(made[0]), made[1]
    programs[0] = change(programs[0], programs[0].inputs[0], name="time")
    plan = planned(programs, schedules)
    assert list(plan.feed.registers) == ["time"]
    assert plan.feed.records[0][0] == Fed(REGISTERS)


def test_word_below_26_bits_is_refused() -> None:
    with pytest.raises(InputError, match=r"^word: wanted 26 to 32 bits"):
        system_core(["complementary"], word=25)


def test_parameters_of_a_stranger_are_refused() -> None:
    with pytest.raises(InputError, match=r"^parameters of mekf: wanted one of complementary"):
        system_core(["complementary"], params={"mekf": {"tilt_var": 1e-3}})


def test_parameters_go_to_their_program() -> None:
    core = system_core(["complementary"], params={"calibrate_field": {"field_xx": 0.25}})
    program = core.parts[2].program
    assert program.values[program.find("field_xx")].initial == 1 << 30
