"""The input reader: the same inputs from one call as from many, and what it refuses."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.records.reader import InputReader

pytestmark = pytest.mark.pythons

NAN = float("nan")


class Probe(Estimator):
    """One input of each kind."""

    inputs = (
        Input("ok", 0.0, 1.0, "", valid_of=("z", "c")),
        Input("z", -2.0, 2.0, "m", missing="hold"),
        Input("c", -1.0, 3.0, "", missing=0.5, clamp=True),
        Input("plain", -4.0, 4.0, "rad/s"),
        Input("only_z", -1.0, 2.0, "", valid_of="z"),
    )
    outputs = (Output("y", "m"),)


def reader(estimator: type[Estimator] = Probe, runs: int = 1, **options: Any) -> InputReader:
    def place(row: int, run: int, name: str) -> str:
        return f"log, {name}[{row}, {run}]"

    return InputReader(estimator(), place, runs=runs, **options)


def by_hand(rows: list[tuple[float, float, float]]) -> tuple[list[Any], list[Any], int]:
    """What `Probe` reads."""
    out, new, clamped, last = [], [], 0, NAN
    for z, c, plain in rows:
        has_z, has_c = z == z, c == c
        last = z if has_z else last
        value = c if has_c else 0.5
        clamped += not -1.0 <= value <= 3.0
        value = max(-1.0, min(3.0, value))
        out.append([float(has_z and has_c), last, value, plain, float(has_z)])
        new.append([has_z and has_c, has_z, has_c, True, has_z])
    return out, new, clamped


gap = st.just(NAN)
samples = st.tuples(st.floats(-2.0, 2.0) | gap, st.floats(-9.0, 9.0) | gap, st.floats(-4.0, 4.0))
rows_of_a_run = st.lists(samples, min_size=8, max_size=8).map(
    lambda rows: [(rows[0][0] if rows[0][0] == rows[0][0] else 1.0, *rows[0][1:]), *rows[1:]]
)


@settings(max_examples=150)
@given(st.lists(rows_of_a_run, min_size=1, max_size=3), st.sets(st.integers(1, 7)))
def test_pieces_of_any_length_and_any_number_of_runs(
    runs: list[list[tuple[float, float, float]]], borders: set[int]
) -> None:
    table = np.array(runs).transpose(1, 0, 2)
    inputs = reader(runs=len(runs))
    parts = []
    for first, last in zip([0, *sorted(borders)], [*sorted(borders), 8], strict=True):
        columns = dict(zip(("z", "c", "plain"), np.moveaxis(table[first:last], 2, 0), strict=True))
        parts.append(inputs.take({**columns, "more": "ignored"}, last - first))
    found, new = (np.concatenate(part) for part in zip(*parts, strict=True))
    wanted = [by_hand(rows) for rows in runs]
    for k, (values, fresh, _) in enumerate(wanted):
        assert found[:, k].tolist() == values
        assert new[:, k].tolist() == fresh
    clamped = sum(count for *_, count in wanted)
    assert inputs.clamped == ({"c": clamped} if clamped else {})
    assert inputs.rows == 8


@pytest.mark.parametrize(
    "low, high, valid, missed",
    [(0.0, 1.0, 1.0, 0.0), (-1.0, 1.0, 1.0, 0.0), (0.0, 2.0, 1.0, 0.0), (0.0, 0.5, 0.5, 0.0),
     (0.25, 4.0, 1.0, 0.25)],
)  # fmt: skip
def test_flags_are_one_and_nothing(low: float, high: float, valid: float, missed: float) -> None:
    class Flagged(Estimator):
        inputs = (Input("z", 0.0, 1.0, "", missing=0.0), Input("f", low, high, "", valid_of="z"))
        outputs = (Output("y"),)

    found, _ = reader(Flagged).take({"z": np.array([[1.0], [NAN]])}, 2)
    assert found[:, 0, 1].tolist() == [valid, missed]


GOOD = {"z": 1.0, "c": 0.0, "plain": 2}


@pytest.mark.parametrize(
    "record, message",
    [
        ({"z": 1.0, "plain": 0.0}, "c[2, 0]: wanted a value for every input of probe, found none"),
        ({**GOOD, "z": None}, "z[2, 0]: wanted a number, found NoneType; "),
        ({**GOOD, "z": "fast"}, "z[2, 0]: wanted a number, found str; "),
        ({**GOOD, "z": 10**400}, "z[2, 0]: wanted a number, found int; "),
        ({**GOOD, "z": np.zeros(3)}, "z[2, 0]: wanted a number, found ndarray; "),
        ({**GOOD, "z": -np.inf}, "z[2, 0]: wanted a finite number, found an infinite one; "),
        # Not even where an input is clamped.
        ({**GOOD, "c": np.array([0.0, np.inf])}, "c[2, 1]: wanted a finite number, found an inf"),
        ({**GOOD, "plain": np.array([0.0, NAN])}, "plain[2, 1]: wanted a number, found no value; "
         "complete the log, or declare Input('plain', ..., missing=...)"),
        ({**GOOD, "z": 2.5}, "z[2, 0]: wanted -2 to 2 m, the declared range, found 2.5, and 1 more "
         "beyond it; "),
        ({**GOOD, "plain": np.array([4.0, -4.5])}, "plain[2, 1]: wanted -4 to 4 rad/s, the "
         "declared range, found -4.5; correct the unit in the header, or the range; clamp=True "
         "would clamp it"),
    ],
)  # fmt: skip
def test_refused(record: Any, message: str) -> None:
    inputs = reader(runs=2)
    inputs.take(GOOD)
    inputs.take(GOOD)
    with pytest.raises(InputError, match=f"^{re.escape('log, ' + message)}"):
        inputs.take(record)


def test_nothing_to_hold() -> None:
    wanted = r"z\[0, 0\]: wanted a number in the first row, found no value; complete the log$"
    with pytest.raises(InputError, match=wanted):
        reader().take({**GOOD, "z": NAN})
    with pytest.raises(InputError, match="found no value; mend it$"):
        reader(fix="mend it").take({**GOOD, "z": NAN})


def test_inputs_that_others_give() -> None:
    found, _ = reader(linked={1}).take({"c": 1.0, "plain": 2.0})
    assert found[0, 0].tolist() == [1.0, 0.0, 1.0, 2.0, 1.0]
