"""Time steps."""

import re

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.steps import RESTART_S, steps_of

pytestmark = pytest.mark.pythons


def test_each_ends_at_its_sample_and_the_first_is_the_median() -> None:
    assert steps_of("a", np.array([1.0, 1.5, 1.75, 2.75])).tolist() == [0.5, 0.5, 0.25, 1.0]
    assert steps_of("a", np.array([0, 4])).tolist() == [4.0, 4.0]


@pytest.mark.parametrize("t", [[], [1.0]])
def test_one_sample_has_no_step(t: list[float]) -> None:
    message = "log 'a': wanted two rows or more, for a time step, found one; use a longer "
    with pytest.raises(InputError, match=f"^{re.escape(message)}log, or give a column dt$"):
        steps_of("log 'a'", np.array(t))


def test_restart() -> None:
    assert RESTART_S == -0.25
