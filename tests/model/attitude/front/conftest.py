"""Shared by the tests of the front programs: parameters, float and fixed runs of many samples."""

from collections.abc import Callable

import numpy as np
import pytest

from boresight.model.estimator import Estimator, input_words, with_params
from boresight.model.words.interpreter import Interpreter
from tests.support.compiled_float import numpy_float


@pytest.fixture
def draw() -> Callable:
    """Random legal parameters: matrices near their default, or anything at all."""

    def make(estimator: Estimator, seed: int, spread: float = 0.1) -> dict[str, float]:
        rng = np.random.default_rng(seed)
        return {
            p.name: float(np.clip(p.default + spread * p.high * rng.uniform(-1, 1), p.low, p.high))
            for p in estimator.params
            if "mount" not in p.name and p.name != "tick_s"
        }

    return make


@pytest.fixture
def both() -> Callable:
    """Outputs (n,) by name, in float and in fixed point, and whether any value saturated."""

    def run(estimator: Estimator, inputs, params=None, word: int = 32):
        x = np.asarray(inputs, dtype=float)  # (n, n_inputs)
        fl = numpy_float(estimator, x[:, :, None], params=params)
        program = with_params(estimator.compile(word=word), estimator, params)
        machine = Interpreter(program)
        words = input_words(program, x[:, :, None])
        rows = [machine.update(row) for row in words]
        fixed = {
            name: program.format(n).real(np.array([out[k, 0] for out, _ in rows]))
            for k, (name, n) in enumerate(zip(program.output_names, program.outputs, strict=True))
        }
        return (
            {k: v[:, 0] for k, v in fl.items()},
            fixed,
            bool(any(saturated[0] for _, saturated in rows)),
        )

    return run
