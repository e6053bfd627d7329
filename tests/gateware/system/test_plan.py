"""What the conductor is told of a core: refused when the programs do not fit together."""

from dataclasses import replace

import pytest

from boresight.gateware.system.plan import FRONT_NAMES, RECORD, plan_of
from boresight.gateware.system.programs import FILTERS, core_plan, system_core, system_estimators
from boresight.model.errors import InputError


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
    assert (plan.word, plan.outputs, plan.count_bits) == (32, 8, 16)


def test_all_programs_stand_in_their_order() -> None:
    assert tuple(e.name for e in system_estimators()) == (*FILTERS, *FRONT_NAMES)


def test_front_programs_must_be_the_last(made) -> None:
    programs, schedules = made
    for wrong in (programs[1:], programs[::-1], programs[:-1]):
        with pytest.raises(ValueError, match=r"^programs must be filters, then calibrate_inertial"):
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


def test_records_must_be_the_usual_ones(made) -> None:
    programs, schedules = list(made[0]), made[1]
    programs[0] = change(programs[0], programs[0].inputs[0], name="time")
    with pytest.raises(ValueError, match=r"^complementary must have the inputs \('dt', 'gx'"):
        plan_of(programs, schedules)


def test_record_comes_before_the_first_output(made) -> None:
    programs, schedules = made
    late = replace(schedules[0], gets=(*schedules[0].gets[:-1], min(schedules[0].latencies)))
    with pytest.raises(ValueError, match=r"^complementary must take its record before"):
        plan_of(programs, [late, *schedules[1:]])


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
    assert RECORD[0] == "dt"
