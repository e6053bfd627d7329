"""What a world's record may not be; what it becomes, tests/sim/records/test_feed.py says."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.worlds.intake import Intake

NAN = float("nan")


class Probe(Estimator):
    """A held input and one that must be there."""

    inputs = (Input("z", -2.0, 2.0, "m", missing="hold"), Input("plain", -4.0, 4.0, ""))
    outputs = (Output("y"),)


GOOD = {"z": 1.0, "plain": 2}


@pytest.mark.parametrize(
    "record, message",
    [
        ({"z": 1.0}, "world w, step 2, plain: wanted a value for every input of probe, found none"),
        ({**GOOD, "z": None}, "world w, step 2, z: wanted a number, found NoneType; correct the "
         "record that the world returns"),
        ({**GOOD, "z": "fast"}, "world w, step 2, z: wanted a number, found str; "),
        ({**GOOD, "z": 10**400}, "world w, step 2, z: wanted a number, found int; "),
        ({**GOOD, "z": np.zeros(2)}, "world w, step 2, z: wanted a number, found ndarray; "),
        ({**GOOD, "z": -np.inf}, "world w, step 2, z: wanted a finite number, found an infinite "),
        ({**GOOD, "plain": NAN}, "world w, step 2, plain: wanted a number, found no value; "),
        ({**GOOD, "z": 2.5}, "world w, step 2, z: wanted -2 to 2 m, found 2.5; "),
        ({**GOOD, "plain": -4.5}, "world w, step 2, plain: wanted -4 to 4, found -4.5; "),
    ],
)  # fmt: skip
def test_refused(record: Any, message: str) -> None:
    intake = Intake(Probe(), "world w")
    for _ in range(2):
        intake.take(GOOD)
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        intake.take(record)


def test_nothing_to_hold() -> None:
    message = "world w, step 0, z: wanted a number, found no value; "
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        Intake(Probe(), "world w").take({"z": NAN, "plain": 0.0})


def test_numbers_of_any_kind() -> None:
    taken = Intake(Probe(), "w").take({"z": np.float32(0.5), "plain": True, "more": "ignored"})
    assert taken.dtype == np.float64 and taken.tolist() == [0.5, 1.0]
