"""Random expressions stay in their intervals, without a flag, and within what formats explain."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.words.interpreter import Interpreter
from tests.support.random_functions import random_functions

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize("word", [18, 22, 32])
def test_within_the_bound_of_their_errors(word: int) -> None:
    known, refused, shares = [], 0, []
    for seed in range(60):
        try:
            program, words, wanted = random_functions(seed, word)
        except InputError as error:  # wrapped, of a quotient: its author has to say more
            assert " up to " in str(error)
            refused += 1
            continue
        out, saturated = Interpreter(program, words.shape[1]).update(words)
        assert not saturated.any(), f"seed {seed}"
        for k, want in enumerate(wanted):
            got = program.format(program.outputs[k]).real(out[k])
            sure = np.isfinite(want.error)
            deviation, bound = np.abs(got - want.value)[sure], want.error[sure]
            assert np.all(deviation <= bound), f"seed {seed}, output {k}"
            known.append(sure.mean())
            shares += list(deviation[bound > 0.0] / bound[bound > 0.0])
    # Most points count, and the bounds are no wider than they have to be.
    assert refused <= 6 and np.mean(known) > 0.7
    assert np.median(shares) > 0.003
