"""Emulator equals interpreter, cycle counts equal the schedule's."""

import numpy as np
import pytest

from boresight.gateware.machine import ALL_CONFIGS, Machine
from boresight.gateware.microcode.assemble import assemble
from boresight.gateware.microcode.emulator import Emulator
from boresight.gateware.schedule.allocate import allocate_together
from boresight.gateware.schedule.scheduler import Schedule, schedule
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Program
from tests.support.random_program import poke, random_inputs, random_program

MACHINES = pytest.mark.parametrize("machine", ALL_CONFIGS.values(), ids=ALL_CONFIGS)


def build(program: Program, machine: Machine) -> tuple[Schedule, Emulator]:
    s = schedule(program, machine)
    return s, Emulator(machine, assemble(s, allocate_together([s])[0]))


def compare(program: Program, machine: Machine, steps: int = 5) -> None:
    """Outputs, saturation, cycles of ``steps`` updates."""
    s, core = build(program, machine)
    model = Interpreter(program)
    for k, words in enumerate(random_inputs(program, 1, steps)):
        out, saturated = model.update(np.array(words)[:, None])
        record = core.update(words)
        assert record.outputs == out[:, 0].tolist()
        assert record.lasts == [False] * (len(program.outputs) - 1) + [True]
        assert core.saturated == saturated[0] and not core.framing
        assert record.cycles == s.length
        assert tuple(c + 1 for c in record.emitted) == s.latencies
        assert core.parity == (k + 1) % 2
        core.saturated = False


@MACHINES
@pytest.mark.parametrize("seed", range(12))
def test_equals_interpreter(machine: Machine, seed: int) -> None:
    compare(random_program(seed, n_ops=4 + 7 * seed, recent=seed % 4 / 3), machine)


@MACHINES
def test_parameters(machine: Machine) -> None:
    seed = next(k for k in range(50) if random_program(k).of_kind(Kind.PARAM))
    p = random_program(seed)
    s, core = build(p, machine)
    model = Interpreter(p)
    for number, n in enumerate(p.of_kind(Kind.PARAM)):
        poke(core, number, 1 << 20 + number)
        model.params[n] = 1 << 20 + number
    for words in random_inputs(p, 4, 3):
        out, _ = model.update(np.array(words)[:, None])
        assert core.update(words).outputs == out[:, 0].tolist()


@MACHINES
@pytest.mark.parametrize("late", [False, True])
def test_framing(machine: Machine, late: bool) -> None:
    """A torn record leaves no trace but the flag."""
    p = random_program(6, n_inputs=5, n_states=4)
    _, core = build(p, machine)
    model = Interpreter(p)
    first, torn, second = random_inputs(p, 5, 3)
    records = [first, torn * 2 if late else torn[:3], second]
    for k, words in enumerate(records):
        record = core.update(words)
        if k == 1:
            assert core.framing
            continue
        out, _ = model.update(np.array(words)[:, None])
        assert record.outputs == out[:, 0].tolist()


@MACHINES
def test_a_record_in_two_parts(machine: Machine) -> None:
    """Cycles go on where the machine waited; it takes no other program meanwhile."""
    p = random_program(6, n_inputs=5)
    (words,) = random_inputs(p, 1, 1)
    stream = [(w, k == 4) for k, w in enumerate(words)]
    whole, core = (build(p, machine)[1] for _ in range(2))
    expected = whole.update(words)
    first = core.feed(iter(stream[:2]))
    with pytest.raises(ValueError, match=r"^the program must be selected between updates$"):
        core.select(0)
    second = core.feed(iter(stream[2:]))
    assert [*first.writes, *second.writes] == expected.writes
    assert (second.outputs, second.emitted) == (expected.outputs, expected.emitted)
    assert first.cycles < second.cycles == expected.cycles
