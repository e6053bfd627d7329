"""The conductor's words, the feed and the plan of programs."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from amaranth.hdl import Const, Module, Signal
from amaranth.sim import Simulator

from boresight.gateware.attitude.system.conductor_words import Job, Step, last_words, table
from boresight.gateware.attitude.system.feed import (
    HELD,
    PLACES,
    REGISTERS,
    ZERO,
    Fed,
    Feed,
    feed_of,
    reset_word,
)
from boresight.gateware.attitude.system.plan import FRONT_NAMES, plan_of
from boresight.gateware.attitude.system.programs import core_plan, system_core, system_estimators
from boresight.model.attitude import FILTERS
from boresight.model.declarations import Input, Output
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.attitude.board.chain import COUNTS, NO_LINE, Samples
from tests.support.attitude.conductor_bench import _parse, sample_command, script_of

# -- tables and layouts of the conductor; test_conductor.py runs it whole -------------------------


def comb(m: Module, bench) -> None:
    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()


@pytest.mark.parametrize("entries", [[5], [1, 2], [7, 7, 7], [3, 1, 4, 1, 5]])
def test_tables_end_with_their_last_entry(entries: list[int]) -> None:
    m = Module()
    index = Signal(3)
    result = Signal(8)
    m.d.comb += result.eq(table(index, entries))

    async def bench(ctx):
        for k in range(8):
            ctx.set(index, k)
            assert ctx.get(result) == entries[min(k, len(entries) - 1)]

    comb(m, bench)


def test_a_table_of_one_entry_asks_for_no_number() -> None:
    assert isinstance(table(Signal(3), [7, 7]), Const)
    assert not isinstance(table(Signal(3), [7, 8]), Const)


#: Estimator 1 reads what estimator 0 gives; records of 4 and 7 words.
PLAN: Any = SimpleNamespace(
    filters=2, chains=((0,), (0, 1)), feed=SimpleNamespace(records=((None,) * 4, (None,) * 7))
)


def test_steps_along_a_chain() -> None:
    m, step = Module(), Step(PLAN)
    program = Signal(2)
    following = Signal(2)
    last = Signal()
    m.d.comb += [program.eq(step.program), following.eq(step.following), last.eq(step.last)]

    async def bench(ctx):
        for running, at, wanted in ((0, 0, (0, 0, 1)), (1, 0, (0, 1, 0)), (1, 1, (1, 1, 1))):
            ctx.set(step.running, running)
            ctx.set(step.step, at)
            assert (ctx.get(program), ctx.get(following), ctx.get(last)) == wanted

    comb(m, bench)


def test_the_last_word_of_each_record() -> None:
    m = Module()
    step = Step(PLAN)
    last = Signal(4)
    m.d.comb += last.eq(last_words(PLAN, step))

    async def bench(ctx):
        for job, running, at, wanted in (
            (Job.INERTIAL, 0, 0, 7),
            (Job.COUNTS, 0, 0, 2),
            (Job.HEADING, 1, 1, 2),
            (Job.FILTER, 0, 0, 3),
            (Job.FILTER, 1, 0, 3),
            (Job.FILTER, 1, 1, 6),
        ):
            ctx.set(step.job, job)
            ctx.set(step.running, running)
            ctx.set(step.step, at)
            assert ctx.get(last) == wanted, (job, running, at)

    comb(m, bench)


# -- the script of samples, and what is read out of the bench's text ------------------------------


def test_script_sends_the_line_of_an_update_while_the_one_before_is_at_work() -> None:
    stimulus = Samples(
        stamp=np.array([1, 2**32 - 1]),
        counts=np.array([[1, -1, 0, 0, 0, 0]] * 2),
        line=np.array([NO_LINE, COUNTS]),
        values=np.array([[0, 0, 0], [5, -5, 9]]),
        restart=np.array([True, True]),
        filter=np.array([2, 3]),
    )
    assert script_of(stimulus, start=["u 1"]) == [
        "u 1",
        "f 2",
        "w 10",
        "s 1 1 ffff 0 0 0 0",
        "l 1 5 fffb 9",
        "n 1",
        "w 180",
        "f 3",
        "r",
        "s ffffffff 1 ffff 0 0 0 0",
        "n 2",
        "w 80",
    ]
    assert sample_command(-1, [0] * 6) == "s ffffffff 0 0 0 0 0 0"


def test_text_of_the_bench() -> None:
    played = _parse("S 5\nE 7 68\nU 9\nD 0 ffffffff\nD 1 7\nQ 0 1\nR 514 abc\n- done\n", 32)
    assert (played.sampled, played.updated) == ([5], [9])
    assert played.events == [(7, "restart"), (7, "watchdog")]
    assert played.results == [[-1, 7]]
    assert played.taken == [[1]]
    assert played.reads == [(514, 0xABC)]
    assert played.words(0, 2).tolist() == [[-1, 7]]
    with pytest.raises(ValueError, match=r"^the bench says 'bad command'$"):
        _parse("bad command\n", 32)


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


# -- what the conductor is told of a core: refused when the programs do not fit together ----------


@pytest.fixture(scope="module")
def core():
    return system_core(["complementary"])


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
    core = system_core(["complementary"], params={"calibrate_field": {"field_xx": 0.25}})
    program = core.parts[2].program
    assert program.values[program.find("field_xx")].initial == 1 << 30
