"""What the conductor is told of a core: refused when the programs do not fit together."""

from dataclasses import replace

import pytest

from boresight.gateware.system.feed import REGISTERS, Fed
from boresight.gateware.system.plan import FRONT_NAMES, plan_of
from boresight.gateware.system.programs import core_plan, system_core, system_estimators
from boresight.model.errors import InputError
from boresight.model.estimators import FILTERS


@pytest.fixture(scope="module")
def core():
    return system_core(["complementary"], restarts=0)


@pytest.fixture(scope="module")
def made(core):
    return [p.program for p in core.parts], [p.schedule for p in core.parts]


def test_plan(core) -> None:
    plan = core_plan(core)
    assert plan.names == ("complementary", *FRONT_NAMES)
    assert (plan.filters, plan.inertial, plan.field, plan.compass) == (1, 1, 2, 3)
    assert plan.lengths == tuple(p.schedule.length for p in core.parts)
    assert (plan.word, plan.outputs, plan.count_bits) == (32, (8,), 16)
    assert plan.chains == ((0,),) and not plan.feed.wide and not plan.early


def test_all_programs_stand_in_their_order() -> None:
    assert tuple(e.name for e in system_estimators(FILTERS)) == (*FILTERS, *FRONT_NAMES)


def test_front_programs_must_be_the_last(made) -> None:
    programs, schedules = made
    for wrong in (programs[1:], programs[::-1], programs[:-1]):
        with pytest.raises(
            ValueError, match=r"^programs must be estimators, then calibrate_inertial"
        ):
            plan_of(wrong, schedules)


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
        plan_of(programs, schedules)


def test_an_unknown_name_is_a_register(made) -> None:
    programs, schedules = list(made[0]), made[1]
    programs[0] = change(programs[0], programs[0].inputs[0], name="time")
    plan = plan_of(programs, schedules)
    assert list(plan.feed.registers) == ["time"]
    assert plan.feed.records[0][0] == Fed(REGISTERS)


def test_an_output_may_come_before_the_record_ends(made) -> None:
    programs, schedules = made
    late = replace(schedules[0], gets=(*schedules[0].gets[:-1], min(schedules[0].latencies)))
    assert plan_of(programs, [late, *schedules[1:]]).early
    with pytest.raises(ValueError, match=r"^programs before the estimators must take all before"):
        plan_of(programs, [schedules[0], late, *schedules[2:]])


def test_word_below_26_bits_is_refused() -> None:
    with pytest.raises(InputError, match=r"^word: wanted 26 to 32 bits"):
        system_core(["complementary"], word=25)


def test_parameters_of_a_stranger_are_refused() -> None:
    with pytest.raises(InputError, match=r"^parameters of mekf: wanted one of complementary"):
        system_core(["complementary"], params={"mekf": {"tilt_var": 1e-3}})


def test_parameters_go_to_their_program() -> None:
    core = system_core(
        ["complementary"], params={"calibrate_field": {"field_xx": 0.25}}, restarts=0
    )
    program = core.parts[2].program
    assert program.values[program.find("field_xx")].initial == 1 << 30
