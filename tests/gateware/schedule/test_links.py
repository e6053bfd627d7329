"""Programs that read what others keep: the scheduler's side, the emulator, the hardware."""

import dataclasses
import random
from collections.abc import Callable
from typing import Any

import pytest
from amaranth.hdl import ResetInserter, Signal

from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.microcode.emulator import Emulator
from boresight.gateware.schedule.links import Window, open_states, tied, window_of
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.linking import linked_estimators
from tests.support.bench import pulse, run_bench
from tests.support.linked import Inner, Middle, Models, Outer, linked_core
from tests.support.shared import shared_core

CONFIG = pytest.mark.parametrize("config", sorted(CONFIGS))
MASK = (1 << 32) - 1


def programs():
    return [e.compile() for e in linked_estimators([Outer(), Middle(), Inner()])]


def words(rng: random.Random, count: int) -> list[int]:
    return [rng.randrange(-(1 << 30), 1 << 30) for _ in range(count)]


def test_outputs_that_are_read_become_states() -> None:
    outer, middle, inner = tied(programs())
    # ``half`` is one already, ``product`` becomes one for both of its readers.
    assert [inner.values[s].name for s, _ in inner.states] == ["half", "product.kept"]
    assert dict(inner.states)[inner.find("product.kept")] == inner.outputs[1]
    assert [inner.values[k.state].name for k in middle.links] == ["half", "product.kept"]
    assert middle.values[outer.links[0].state].name == "sum.kept"
    assert [middle.values[n].name for n in middle.streamed] == ["c", "d"]
    assert open_states([outer, middle, inner]) == [
        set(),
        {middle.find("sum.kept")},
        {inner.find("half"), inner.find("product.kept")},
    ]


def test_a_kept_output_has_a_name_of_its_own() -> None:
    outer, middle, inner = programs()
    number = inner.inputs[0]
    values = list(inner.values)
    values[number] = dataclasses.replace(values[number], name="product.kept")
    inner = tied([outer, middle, dataclasses.replace(inner, values=tuple(values))])[2]
    assert [inner.values[s].name for s, _ in inner.states] == ["half", "product.kept_"]


def test_a_link_changes_the_identity() -> None:
    """What the hardware does is another thing; what a program alone says of its sources is not."""
    _, middle, _ = programs()
    assert middle.digest == dataclasses.replace(middle, links=()).digest
    assert tied(programs())[1].digest != middle.digest


def test_programs_apart_keep_their_records() -> None:
    outer, middle, inner = programs()
    [alone] = tied([middle])
    assert alone.streamed == alone.inputs and not alone.linked
    assert tied([inner])[0] is inner
    first, second = tied([outer, middle])
    assert [outer.values[n].name for n in first.streamed] == ["e", "product", "f"]
    assert second.streamed == second.inputs


def test_formats_must_be_the_sources() -> None:
    with pytest.raises(ValueError, match=r"^middle must take inner.half as fixed<32,1>, not as"):
        tied([e.compile() for e in (Middle(), Inner())])


@pytest.mark.parametrize(
    ("window", "slots", "block", "owners"),
    [
        (Window(64, (2,)), 128, 64, [None, None, 2, 2]),
        (Window(64, (1, 0)), 128, 32, [None, None, 1, 0]),
        (Window(64, (0, 1, 2)), 128, 16, [None, None, 0, 2]),
    ],
)
def test_window(window: Window, slots: int, block: int, owners: list[int | None]) -> None:
    assert window.block == block
    assert [window.owner(s, slots) for s in (0, 63, 64, 96)] == owners
    assert all(window.owner(window.first(o, slots), slots) == o for o in window.owners)
    assert window.owner(64 + block * len(window.owners) - 1, slots) == window.owners[-1]
    past = 64 + block * len(window.owners)
    assert past == 128 or window.owner(past, slots) is None


@CONFIG
def test_the_window_leaves_room_for_other_states(config: str) -> None:
    core = linked_core(config)
    plans = [part.schedule for part in core.parts]
    assert (
        window_of(plans) == core.image.window == Window(plans[0].machine.state_slots // 2, (1, 2))
    )
    for part in core.parts:  # what is linked is there from the first cycle to the last
        spans = {t.value: (t.start, t.end) for t in part.allocation.live_ranges}
        last = part.schedule.length - 1
        assert all(spans[n] == (0, last) for n in part.program.linked)
    alone = build_shared_core([Inner().compile()], config)
    assert window_of([alone.parts[0].schedule]) is alone.image.window is None


class Open(Estimator):
    """All that it has is read by another."""

    inputs = (Input("a", -1.0, 1.0),)
    states = (State("s", -1.0, 1.0),)
    outputs = (Output("s"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A low pass."""
        s = 0.5 * x.s + 0.5 * u.a
        return {"s": s}, {"s": s}


class Reader(Estimator):
    """Reads it."""

    inputs = (Input("b", -1.0, 1.0), Input("s", -1.0, 1.0, source="open.s"))
    outputs = (Output("p"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A product."""
        return {}, {"p": u.b * u.s}


class Twice(Reader):
    """Reads one word as two inputs, of which one is limited."""

    inputs = (*Reader.inputs, Input("part", -0.25, 0.25, source="open.s", clamp=True))
    outputs = (Output("difference"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """What the limit takes away, and the record's word."""
        return {}, {"difference": u.s - u.part + u.b}


def test_two_inputs_of_one_source() -> None:
    core = build_shared_core([e.compile() for e in linked_estimators([Twice(), Open()])], "small")
    machine, models = Emulator(core.machine, core.image), Models(core)
    for number, word in ((1, 1 << 30), (0, 5), (1, -(1 << 30)), (1, 1 << 29), (0, -7)):
        machine.select(number)
        assert machine.update([word]).outputs == models.update(number, [word])


class OpenTwice(Open):
    """The word that is read is the next one of two states, which begin otherwise."""

    name = "open"
    states = (State("s", -1.0, 1.0, initial=0.75), State("old", -1.0, 1.0, initial=-0.5))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A low pass."""
        s = 0.5 * x.s + 0.25 * x.old + 0.25 * u.a
        return {"s": s, "old": s}, {"s": s}


def test_a_word_of_two_states_before_the_first_update() -> None:
    """It is that of the first of them, on the machine as in a comparison's records."""
    core = build_shared_core(
        [e.compile() for e in linked_estimators([Reader(), OpenTwice()])], "small"
    )
    machine, models = Emulator(core.machine, core.image), Models(core)
    half = core.parts[0].program.format(core.parts[0].program.inputs[0]).quantise(0.5)
    wanted = models.update(0, [int(half)])
    assert machine.update([int(half)]).outputs == wanted and wanted[0] > 0


def test_the_window_is_never_all_states() -> None:
    """Even where there are no others: its half tells it apart."""
    core = build_shared_core([e.compile() for e in linked_estimators([Reader(), Open()])], "small")
    assert core.image.window == Window(core.parts[0].schedule.machine.state_slots // 2, (1,))


class Large(Open):
    """The same beside more states than half of them all."""

    name = "open"
    more = tuple(f"m{k}" for k in range(70))
    states = (*Open.states, *(State(name, -1.0, 1.0) for name in more))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A delay line besides."""
        states, outputs = super().step(x, u, p)
        values = [u.a, *(getattr(x, name) for name in self.more[:-1])]
        return states | dict(zip(self.more, values, strict=True)), outputs


def test_the_window_shrinks_where_other_states_need_the_room() -> None:
    core = build_shared_core([e.compile() for e in linked_estimators([Reader(), Large()])], "small")
    assert core.image.window == Window(32, (1,))
    reader, plan = (part.schedule for part in core.parts)
    after = {plan.program.values[n].name: number for n, number in plan.program.states}
    ops = [op.dest for op in plan.program.ops]
    for moved, size in ((5, 32), (6, 64)):  # of 70 to another bank
        others = {ops.index(after[name]) for name in Large.more[:moved]}
        slots = [dataclasses.replace(t, lane=int(t.op in others)) for t in plan.slots]
        spread = dataclasses.replace(plan, slots=tuple(slots))
        assert window_of([reader, spread]) == Window(size, (1,))


def test_no_room_for_the_window() -> None:
    core = linked_core()
    plans = [part.schedule for part in core.parts]

    class Narrow(Machine):
        state_slots = 8

    tight = [dataclasses.replace(p, machine=Narrow("narrow", 1)) for p in plans]
    assert window_of(tight) == Window(4, (1, 2))  # two words in a block of two
    Narrow.state_slots = 4
    with pytest.raises(
        ScheduleError, match=r"^middle, inner: no room in the narrow machine for 3 "
    ):
        window_of(tight)


def cores() -> list[Any]:
    """Programs that read each other, and those that share states, which need one lane."""
    linked = [pytest.param(linked_core, c, id=f"linked-{c}") for c in sorted(CONFIGS)]
    shared = [c for c in sorted(CONFIGS) if CONFIGS[c].lanes == 1]
    return [*linked, *(pytest.param(shared_core, c, id=f"shared-{c}") for c in shared)]


def record_of(core: Core, number: int, rng: random.Random) -> list[int]:
    return words(rng, len(core.parts[number].program.streamed))


@pytest.mark.parametrize(("made", "config"), cores())
def test_emulator_in_turns(made: Callable[[str], Core], config: str) -> None:
    core = made(config)
    machine, models = Emulator(core.machine, core.image), Models(core)
    rng = random.Random(5)
    for _ in range(400):
        number = rng.randrange(3)
        record = record_of(core, number, rng)
        machine.select(number)
        if rng.random() < 0.2:  # a record that is too short: nothing of it is seen
            assert not machine.update(record[:1]).outputs
            machine.select(number)
        result = machine.update(record)
        assert result.outputs == models.update(number, record)
        assert result.cycles == core.parts[number].schedule.length


@pytest.mark.parametrize(("made", "config"), cores())
def test_hardware_in_turns_with_faults_and_resets(made: Callable[[str], Core], config: str) -> None:
    """An update that is abandoned or reset at any cycle leaves the words of the one before."""
    core = made(config)
    models, rng = Models(core), random.Random(11)
    engine = Engine(machine=core.machine, image=core.image, selector=True)
    reset = Signal()
    got: list[int] = []

    async def feed(ctx, number: int, record: list[int], cycles: int = 0) -> None:
        """A record, all of it; or a reset after so many cycles."""
        ctx.set(engine.choice, number)
        spent = 0
        for k, word in enumerate(record):
            ctx.set(engine.i.valid, 1)
            ctx.set(engine.i.payload.data, word & MASK)
            ctx.set(engine.i.payload.last, k == len(record) - 1)
            taken = 0
            while not taken:
                _, _, taken, out, data = await ctx.tick().sample(
                    engine.i.ready, engine.o.valid, engine.o.payload.data
                )
                if k == 0 and not spent and not taken:
                    continue
                spent += 1
                if out:
                    got.append(data - (data >> 31 << 32))
                if cycles and spent >= cycles:
                    taken = 1
        ctx.set(engine.i.valid, 0)
        while cycles and spent < cycles:
            await ctx.tick()
            spent += 1
        if cycles:
            await pulse(ctx, reset)
            await ctx.tick().repeat(8)

    async def drain(ctx, count: int) -> None:
        for _ in range(core.machine.rom_words):
            if len(got) >= count:
                return
            _, _, out, data = await ctx.tick().sample(engine.o.valid, engine.o.payload.data)
            if out:
                got.append(data - (data >> 31 << 32))

    async def test(ctx) -> None:
        ctx.set(engine.o.ready, 1)
        await ctx.tick().repeat(8)
        for _ in range(60):
            number = rng.randrange(3)
            record = record_of(core, number, rng)
            fault = rng.random()
            ctx.set(engine.choice, number)
            await ctx.tick().repeat(8)
            if fault < 0.3:
                length = core.parts[number].schedule.length
                other = record_of(core, number, rng)
                await feed(ctx, number, other, cycles=rng.randrange(len(other), length - 1))
                got.clear()
                await ctx.tick().repeat(8)
            elif fault < 0.5:
                await feed(ctx, number, record[:1])
                await ctx.tick().repeat(8)
            await feed(ctx, number, record)
            await drain(ctx, len(core.parts[number].program.outputs))
            assert got == models.update(number, record), number
            got.clear()
            await ctx.tick().repeat(core.parts[number].schedule.length)

    run_bench(ResetInserter(reset)(engine), test)
