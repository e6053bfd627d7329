"""The float C against the float reference, in single and double precision."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE, SINGLE, Precision
from boresight.model.attitude import estimator
from boresight.model.estimator import Estimator
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.rotations.outputs import attitude_of
from tests.support.compiled_float import compiled_float

# -- float C against the float reference on recorded data -----------------------------------------

#: Largest difference of the attitude on a bundled log, deg. A rounding of an angle near half a
#: turn is 2^-25 half turns, 5e-6 deg; a filter that forgets in 10 s keeps some 2,560 of them at
#: 256 Hz, a random walk of 50: 3e-4 deg. `ekf_quaternion` passes a stretch of `ximu_walk` in which
#: its magnetometer's gate is at the edge and its heading weakly held: 7e-3 deg at update 6919.
BOUND_DEG = {"complementary": 1e-3, "ekf_quaternion": 2e-2, "ekf_bias": 2e-3, "mekf": 1e-3}
#: Updates: the bounds hold for the whole logs.
UPDATES = 1200


def apart_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle of the rotation between two attitudes (n, 4)."""
    half = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)) / 2
    return np.degrees(4 * np.arcsin(np.minimum(half, 1.0)))


@pytest.mark.parametrize("log", ["ximu_walk", "synthetic_60s"])
@pytest.mark.parametrize("name", sorted(BOUND_DEG))
def test_agrees_to_single_precision(name: str, log: str) -> None:
    e = estimator(name)
    records = feed(e, read_record(bundled(log))).inputs[:UPDATES].astype(np.float32)
    reference, _ = compiled_float(e, records.astype(np.float64)[..., None])
    model = FloatCModel(e)
    assert model.states[0].tolist() == [np.float32(s.initial) for s in e.states]
    outputs = model.update(records).astype(np.float64)
    named = {o.name: outputs[:, k] for k, o in enumerate(e.outputs)}
    apart = apart_deg(attitude_of(named), attitude_of(reference)[:, 0])
    assert apart[0] < 1e-4
    assert apart.max() < BOUND_DEG[name]
    assert (named["status"] == reference["status"][:, 0]).all()
    for angle in ("pitch", "roll", "heading"):
        turned = (named[angle] - reference[angle][:, 0] + 1.0) % 2.0 - 1.0
        # Euler angles are worse than the attitude by 1 / cos(pitch).
        assert 180.0 * np.abs(turned).max() < 3 * BOUND_DEG[name]


class Odd(Estimator):
    """An identifier that C reserves, a parameter, a state."""

    name, summary, urgent = "odd", "", 1

    def __init__(self) -> None:
        from boresight.model.estimator import Input, Output, Param, State

        self.inputs = (Input("x", -4.0, 4.0, ""), Input("int", -4.0, 4.0, ""))
        self.params = (Param("gain", 2.0, 0.0, 4.0, "", ""),)
        self.states = (State("sum", -100.0, 100.0, "", 1.0),)
        self.outputs = (
            Output("sum", ""),
            Output("angle", "ht"),
            Output("limited", ""),
            Output("wrapped", "ht"),
            Output("larger", ""),
        )

    def step(self, x, u, p):
        from boresight.model import ops

        total = x.sum + p.gain * u.x
        return {"sum": total}, {
            "sum": total,
            "angle": ops.atan2_ht(u.x, u.int),
            "limited": ops.clip(u.x, -2.0, 3.0),
            "wrapped": ops.wrap_ht(u.x),
            "larger": ops.rsqrt(u.x),
        }


def test_parameters_states_reset() -> None:
    model = FloatCModel(Odd(), params={"gain": 0.5})
    assert model.update([[1.0, 0.0], [2.0, 0.0]])[:, 0].tolist() == [1.5, 2.5]
    assert model.update([[1.0, 0.0]])[:, 0].tolist() == [3.0]
    model.reset()
    assert model.update([[4.0, 0.0]])[:, 0].tolist() == [3.0]


@pytest.mark.parametrize(
    ("y", "x", "angle"),
    [
        (0.0, 0.0, 0.0),
        (0.0, -0.0, 0.0),
        (-0.0, -0.0, 0.0),
        (0.0, -1.0, -1.0),
        (-0.0, -1.0, -1.0),
        (1.0, 0.0, 0.5),
        (-1.0, 0.0, -0.5),
        (1.0, 1.0, 0.25),
    ],
)
def test_arc_tangent_at_its_edges(y: float, x: float, angle: float) -> None:
    assert FloatCModel(Odd()).update([[y, x]])[0, 1] == angle


@pytest.mark.parametrize(
    ("x", "limited", "wrapped"),
    [
        (-4.0, -2.0, 0.0),
        (-2.0, -2.0, 0.0),
        (-1.5, -1.5, 0.5),
        (-1.0, -1.0, -1.0),
        (0.25, 0.25, 0.25),
        (1.0, 1.0, -1.0),
        (3.0, 3.0, -1.0),
        (3.25, 3.0, -0.75),
    ],
)
def test_limits_and_wraps(x: float, limited: float, wrapped: float) -> None:
    assert FloatCModel(Odd()).update([[x, 0.0]])[0, 2:4].tolist() == [limited, wrapped]


def test_root_of_nothing_is_finite() -> None:
    roots = FloatCModel(Odd()).update([[4.0, 0.0], [0.0, 0.0], [-1.0, 0.0]])[:, 4]
    assert roots[0] == 0.5
    assert roots[1] == roots[2] > 1e18


def test_shape_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 2\), not \(2,\)$"):
        FloatCModel(Odd()).update([1.0, 2.0])


# -- single and double precision: literals and the text of C --------------------------------------


@pytest.mark.parametrize(
    "precision, number, text",
    [
        (SINGLE, 0.0, "0.0f"),
        (SINGLE, -0.0, "-0.0f"),
        (SINGLE, 1.0, "1.0f"),
        (SINGLE, 1 / 3, "0.33333334f"),
        (DOUBLE, 1 / 3, "0.3333333333333333"),
        (DOUBLE, 100.0, "100.0"),
        (DOUBLE, 1e-5, "0.00001"),
        (DOUBLE, 1e-9, "1e-9"),
        (SINGLE, 1e20, "1e+20f"),
        (SINGLE, 1e4, "10000.0f"),
        (SINGLE, 1e5, "1e+5f"),
        (SINGLE, 1e-300, "1.1754944e-38f"),
        (SINGLE, -1e-300, "-1.1754944e-38f"),
        (DOUBLE, 1e-300, "1e-300"),
        (DOUBLE, 5e-324, "2.2250738585072014e-308"),
    ],
)
def test_literals(precision: Precision, number: float, text: str) -> None:
    assert precision.literal(number) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_double_literals_give_the_number_back(number: float) -> None:
    text = DOUBLE.literal(number)
    wanted = number
    if 0.0 < abs(number) < 2.0**-1022:
        wanted = math.copysign(2.0**-1022, number)
    assert struct.pack("d", float(text)) == struct.pack("d", wanted)
    assert "." in text or "e" in text  # an integer in C is none


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_single_literals_give_the_number_back(number: float) -> None:
    text = SINGLE.literal(number)
    assert text.endswith("f") and ("." in text or "e" in text)
    if number == 0.0 or abs(number) >= 2.0**-126:
        assert np.float32(text[:-1]) == np.float32(number)


@pytest.mark.parametrize(
    "precision, number, found",
    [
        (SINGLE, 1e39, "a float, not 1e+39"),
        (SINGLE, -1e39, "a float, not -1e+39"),
        (DOUBLE, math.inf, "a double, not inf"),
        (DOUBLE, math.nan, "a double, not nan"),
    ],
)
def test_what_has_no_literal(precision: Precision, number: float, found: str) -> None:
    with pytest.raises(ValueError) as raised:
        precision.literal(number)
    assert str(raised.value) == f"number must be finite in {found}"


TEXT = "float x = 2.5f * fabsf(y_float) + sqrtf(0.5f); // float; my_sinf(atan2f(1.0f, x0.5f))"


def test_text_of_single_precision() -> None:
    assert SINGLE.of_single(TEXT) == TEXT


def test_text_of_double_precision() -> None:
    assert DOUBLE.of_single(TEXT) == (
        "double x = 2.5 * fabs(y_float) + sqrt(0.5); // double; my_sinf(atan2(1.0, x0.5f))"
    )
    functions = ("fabs", "sqrt", "sin", "cos", "asin", "atan2", "floor")
    calls = " ".join(f"{name}f(" for name in functions)
    assert DOUBLE.of_single(calls) == calls.replace("f(", "(")
