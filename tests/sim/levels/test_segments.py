"""Segments side by side are the run from the first sample on, or the fault is placed."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.levels.segments import interpret
from tests.support.random_program import random_inputs, random_program

pytestmark = pytest.mark.pythons


@pytest.fixture(scope="module")
def program() -> Program:
    return random_program(3, n_ops=20, n_inputs=3, n_states=3)


@pytest.fixture(scope="module")
def inputs(program: Program) -> np.ndarray:
    return np.array(random_inputs(program, 5, 300))


@pytest.mark.parametrize(
    "steps, segments", [(2, 256), (7, 256), (8, 1), (17, 2), (100, 7), (300, 256)]
)
def test_as_one_run(program: Program, inputs: np.ndarray, steps: int, segments: int) -> None:
    outputs, saturated, states, broken = interpret(program, inputs[:steps], segments=segments)
    machine, going = Interpreter(program), Interpreter(program)
    for k, row in enumerate(inputs[:steps]):
        wanted, flag = machine.update(row[:, None])
        assert outputs[k].tolist() == wanted[:, 0].tolist() and saturated[k] == flag[0]
        assert states[k].tolist() == [machine.values[state][0] for state, _ in program.states]
    assert broken is None
    cuts = [1, steps // 2 + 1]  # each piece goes on where the one before ended
    parts = [interpret(program, part, machine=going) for part in np.split(inputs[:steps], cuts)]
    for k, whole in enumerate((outputs, saturated, states)):
        assert np.concatenate([part[k] for part in parts]).tolist() == whole.tolist()
    # In segments, too, where its states are known.
    going = Interpreter(program)
    for some in (slice(0, steps // 2), slice(steps // 2, steps)):
        result = interpret(program, inputs[some], states=states[some], machine=going)
        for found, whole in zip(result, (outputs, saturated, states), strict=False):
            assert np.array_equal(found, whole[some])
        assert result[3] is None
        going.states = states[some][-1:].T


@pytest.mark.parametrize("steps, at", [(100, 7), (100, 15), (100, 90)])
def test_a_wrong_state_is_placed(
    program: Program, inputs: np.ndarray, steps: int, at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other level is wrong in states at the end of a segment: the next starts from them."""

    bounds = np.linspace(0, steps, steps // 8 + 1).astype(int)
    end = int(bounds[bounds > at][0]) - 1
    _, _, states, _ = interpret(program, inputs[:steps])
    wrong = states.copy()
    wrong[end] ^= 1 << 24
    _, _, after, placed = interpret(program, inputs[:steps], states=wrong)
    machine = Interpreter(program)
    machine.states = wrong[end][:, None]
    machine.update(inputs[end + 1][:, None])
    assert placed == end and after[end + 1].tolist() == machine.states[:, 0].tolist()
    assert interpret(program, inputs[:steps], states=states)[3] is None
    broken = CModel.trajectory
    monkeypatch.setattr(CModel, "trajectory", lambda *a: (*broken(*a)[:2], wrong))
    assert interpret(program, inputs[:steps])[3] == end
