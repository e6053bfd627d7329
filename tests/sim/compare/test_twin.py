"""What is refused before anything runs: words that cannot hold what is declared."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import boresight
from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.recorded import evaluate
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.twin import check_sound
from boresight.sim.levels.build import Build
from tests.support.narrow import Narrow

STEPS = 48


class Chain(Estimator):
    """An innovation times six gains of far wider ranges than their values."""

    inputs = (Input("z", -1.0, 1.0),)
    params = tuple(Param(f"g{k}", 0.5, -200.0, 200.0) for k in range(6))
    states = (State("x", -2.0, 2.0),)

    def __init__(self, gains: int, tolerance: float = 1e-3, form: Any = None) -> None:
        self.gains, self.form = gains, form or (lambda x, u, after, d: after)
        self.outputs = (Output("y", tolerance=tolerance),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        d = u.z - x.x
        for k in range(self.gains):
            d = d * getattr(p, f"g{k}")
        after = x.x + d
        return {"x": after}, {"y": self.form(x, u, after, d)}


def refusal(estimator: Estimator, word: int = 32, inputs: Any = None, params: Any = None) -> str:
    """What is said of it; empty if nothing is."""
    try:
        build = Build(estimator, word=word, params=[params])
        check_sound(build, None if inputs is None else [inputs])
    except InputError as error:
        return str(error)
    return ""


def test_intervals_far_beyond_the_range() -> None:
    """Two gains are held in the state's format, six are not; whatever the output makes of it."""
    with pytest.raises(InputError, match="value x_next: wanted an LSB"):
        boresight.compile(Chain(6), output="build")
    assert refusal(Chain(2)) == ""
    said = refusal(Chain(6))
    assert said.startswith("test_twin.py, line ") and "value x_next: wanted an LSB" in said
    assert "of at most 0.001, for the tolerance of output y, found 0.25, for the range" in said
    forms = {
        "tolerance of output y": [
            lambda x, u, after, d: 0.5 - after,
            lambda x, u, after, d: ops.where(u.z < 0.0, ops.clip(d, -1.0, 1.0), x.x),
            lambda x, u, after, d: x.x,  # as the last update left it
        ],
        "quarter of the bits of state x": [lambda x, u, after, d: x.x * u.z],
    }
    for of, some in forms.items():
        for form in some:
            assert of in refusal(Chain(6, form=form)), of


class Gated(Chain):
    """No sum or copy leads from the coarse word to the output."""

    states = ()

    def step(self, x: Any, u: Any, p: Any) -> Any:
        d = 0.5 * u.z
        for k in range(self.gains):
            d = d * getattr(p, f"g{k}")
        return {}, {"y": ops.clip(d, -1.0, 1.0) * u.z}


def test_words_that_stand_still() -> None:
    """Only running shows it."""
    assert refusal(Gated(2, 1e-4)) == ""
    for inputs in (None, np.linspace(-1.0, 1.0, 50)[:, None]):
        said = refusal(Gated(6, 1e-4), inputs=inputs)
        assert "an LSB that resolves its changes, for the tolerance of output y, found" in said
        assert (
            said.startswith("test_twin.py, line ")
            and "found 0.5, for the range [-8e+08, 8e+08]" in said
        )
    assert refusal(Gated(6, 1e-4), inputs=np.zeros((50, 1))) == ""  # it may stand still there
    assert refusal(Gated(3, 1e-4)) == ""  # it moves, though not as it should


def test_an_output_that_a_false_claim_decides_is_left_to_the_check_of_claims() -> None:
    class Decided(Estimator):
        inputs = (Input("z", -1.0, 1.0),)
        outputs = (Output("y", tolerance=1e-3),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            claimed = ops.bounded(u.z, -0.6, 0.6, "false")
            return {}, {"y": ops.where(claimed > 0.7, 1.0, 0.0)}

    assert refusal(Decided(), inputs=np.full((400, 1), 0.9)) == ""


def test_parameters_are_those_that_were_chosen() -> None:
    """Also where the defaults leave no word to move; and one that stands still may be anywhere."""

    class Zero(Gated):
        params = tuple(Param(f"g{k}", 0.0, -200.0, 200.0) for k in range(6))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": super().step(x, u, p)[1]["y"] + 0.5}

    for inputs in (None, np.linspace(-1.0, 1.0, 50)[:, None], np.zeros((50, 1))):
        for params in ({}, {"g0": 0.5, "g1": 0.5}):
            assert refusal(Zero(2, 1e-4), inputs=inputs, params=params) == ""


def test_a_step_that_is_not_its_record() -> None:
    """For a log that of the chosen parameters counts, else that of all."""

    class Other(Gated):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": ops.where(p.g0 > 1.0, 1.0 * isinstance(u.z, float), u.z)}

    assert "wanted what step" in refusal(Other(0))
    assert refusal(Other(0), inputs=np.linspace(-1.0, 1.0, 50)[:, None]) == ""


def test_a_next_state_has_its_states_format() -> None:
    """An output that is one, too; both hold the sum of far larger terms, and saturate."""
    program = Chain(2).compile()
    (state, after), output = program.states[0], program.outputs[0]
    formats = {program.values[n].frac for n in (state, after, output)}
    assert formats == {29}
    assert (program.values[output].low, program.values[output].high) == (-2.0, 2.0)
    gains = {program.values[n].name: n for n in range(len(program.values))}
    for z, gain, expected in ((1.0, 200.0, 4.0), (-1.0, 200.0, -4.0), (0.3, 0.5, 0.075)):
        machine = Interpreter(program)
        for k in range(2):
            number = gains[f"g{k}"]
            machine.params[number] = int(program.format(number).quantise(gain))
        words = program.format(program.inputs[0]).quantise([[z]])
        out, saturated = machine.update(words)
        assert program.format(output).real(out[0, 0]) == pytest.approx(expected, abs=1e-6)
        assert bool(saturated[0]) is (gain > 1.0)


def stand_still(seed: int) -> bool | None:
    """Whether a core that was compiled has an output that does not move; None if it is refused."""
    estimator, word = Narrow(seed), random.Random(seed).choice((18, 22, 26, 32))
    build = Build(estimator, word=word)
    try:
        check_sound(build)
    except InputError:
        return None
    program, trace = build.programs[0], estimator.trace()
    draw = np.random.default_rng(seed)
    leaves = {
        (kind, d.name): draw.uniform(d.low, d.high, STEPS)
        for kind, declared in (("input", estimator.inputs), ("state", estimator.states))
        for d in declared
    }
    leaves |= {("param", p.name): np.full(STEPS, p.default) for p in estimator.params}
    machine = Interpreter(program, STEPS)
    for (number, _), state in zip(program.states, estimator.states, strict=True):
        machine.values[number] = program.format(number).quantise(leaves["state", state.name])
    words = [
        program.format(number).quantise(leaves["input", i.name])
        for number, i in zip(program.inputs, estimator.inputs, strict=True)
    ]
    out, saturated = machine.update(np.stack(words))
    values, clean = evaluate(trace, leaves), ~saturated
    for k, output in enumerate(estimator.outputs):
        exact = np.broadcast_to(values[trace.outputs[output.name].number], STEPS)[clean]
        form = program.format(program.outputs[k])
        moved = np.ptp(np.clip(exact, form.min, form.max)) if len(exact) > 8 else 0.0
        if moved > 4.0 * (output.tolerance or 0.0) and np.ptp(out[k][clean]) == 0:
            return True
    return False


def narrow(seeds: Sequence[int]) -> None:
    results = [stand_still(seed) for seed in seeds]
    assert [seed for seed, still in zip(seeds, results, strict=True) if still] == []
    assert results.count(False) > len(seeds) // 8 and results.count(None) > len(seeds) // 8


def test_narrow_declarations() -> None:
    narrow(range(40))
