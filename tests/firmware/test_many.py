"""`firmware.many`: each run gives the words of a model of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.firmware.many import ManyCModels
from tests.support.random_program import random_inputs, random_program


@pytest.mark.parametrize("seed, word", [(3, 32), (4, 18)])
def test_each_is_a_model_of_its_own(seed: int, word: int, cache: Path) -> None:
    program, runs, steps = random_program(seed, word=word), 3, 20
    words = np.array(random_inputs(program, seed, steps * runs), dtype=np.int32)
    words = words.reshape(steps, runs, -1)
    many = ManyCModels(program, runs, cache=cache)
    for _ in range(2):  # and again after a reset
        found = [many.update(row) for row in words]
        for k in range(runs):
            outputs, saturated = CModel(program, cache=cache).update(words[:, k])
            assert (np.array([out[k] for out, _ in found]) == outputs).all()
            assert [bool(flags[k]) for _, flags in found] == saturated.tolist()
        assert (found[0][0] != found[-1][0]).any()
        many.reset()


def test_words_are_checked(cache: Path) -> None:
    program = random_program(3)
    many = ManyCModels(program, 2, cache=cache)
    n = len(program.inputs)
    for bad in (np.zeros((1, n), np.int32), np.zeros((2, n)), np.zeros((2, n + 1), np.int32)):
        with pytest.raises(ValueError, match=rf"^inputs must be int32 \(2, {n}\)"):
            many.update(bad)
