"""Segments side by side are the run from the first sample on, or the fault is placed."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.sim.records.segments import interpret
from tests.support.random_program import random_inputs, random_program

pytestmark = pytest.mark.pythons


@pytest.fixture(scope="module")
def program() -> Program:
    return random_program(3, n_ops=20, n_inputs=3, n_states=3)


@pytest.fixture(scope="module")
def inputs(program: Program) -> np.ndarray:
    return np.array(random_inputs(program, 5, 300))


@pytest.mark.parametrize("steps, segments", [(1, 256), (7, 256), (8, 1), (100, 7), (300, 256)])
def test_as_one_run(program: Program, inputs: np.ndarray, steps: int, segments: int) -> None:
    calls: list[tuple[int, int]] = []
    run = interpret(
        program, inputs[:steps], segments=segments, progress=lambda *now: calls.append(now)
    )
    machine = Interpreter(program)
    for k, row in enumerate(inputs[:steps]):
        outputs, saturated = machine.update(row[:, None])
        assert run.outputs[k].tolist() == outputs[:, 0].tolist()
        assert run.saturated[k] == saturated[0]
        states = [machine.values[state][0] for state, _ in program.states]
        assert run.states[k].tolist() == states
    assert run.broken_at is None
    # As many segments as are asked for, none of them shorter than eight steps.
    longest = -(-steps // max(1, min(segments, steps // 8)))
    assert calls == [(k + 1, longest) for k in range(longest)]


@pytest.mark.parametrize("steps, at", [(100, 7), (100, 15), (100, 90)])
def test_a_wrong_state_is_placed(
    program: Program, inputs: np.ndarray, steps: int, at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other level is wrong in a state at the end of a segment: the next starts from it."""

    bounds = np.linspace(0, steps, steps // 8 + 1).astype(int)
    end = int(bounds[bounds > at][0]) - 1
    states = interpret(program, inputs[:steps]).states
    wrong = states.copy()
    wrong[end, -1] ^= 1
    assert interpret(program, inputs[:steps], states=wrong).broken_at == end
    assert interpret(program, inputs[:steps], states=states).broken_at is None
    broken = CModel.trajectory
    monkeypatch.setattr(CModel, "trajectory", lambda *a: (*broken(*a)[:2], wrong))
    assert interpret(program, inputs[:steps]).broken_at == end
