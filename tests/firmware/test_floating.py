"""The float C: strict compilers accept it, and it computes what the float reference does."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.firmware.emit import emit_c
from boresight.firmware.floating import FloatCModel, emit_float_c
from boresight.model import ops
from boresight.model.attitude import estimator
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from boresight.sim.rotations.accuracy import attitude_of
from tests.support.compiled_float import compiled_float, numpy_float
from tests.support.estimators import ALL

STRICT = (
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Werror",
)


@pytest.mark.parametrize("name", sorted(ALL))
def test_single_precision_only_and_no_warning(name: str, tmp_path: Path) -> None:
    files = emit_float_c(ALL[name](), single=True)
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    source = f"{name}_float.c"
    subprocess.run(["gcc", *STRICT, "-O2", "-c", source, "-o", "x.o"], cwd=tmp_path, check=True)
    code = re.sub(r"//.*|/\*[\s\S]*?\*/", "", files[source])
    assert "double" not in code
    assert not re.search(r"(?<![\w.])\d+\.\d+(?!\d*f|\d*e)", code)
    assert not re.search(r"\b(sin|cos|sqrt|atan2|asin|fabs|floor)\(", code)


def test_interface_is_that_of_the_integer_c() -> None:
    e = estimator("mekf")
    integer = emit_c(e.compile())["mekf.h"]
    single = emit_float_c(e, single=True)["mekf_float.h"]

    def members(text: str, kind: str) -> list[str]:
        body = re.search(rf"(?s)typedef struct {{([^}}]*)}} mekf(?:_float)?{kind}_t;", text)
        assert body
        return re.findall(r"(?:int32_t|float) (\w+);", body[1])

    for kind in ("_params", "_state", "_in", "_out"):
        assert members(single, kind) == members(integer, kind)
    for function in ("init", "reset", "update"):
        assert f"void mekf_float_{function}(" in single


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
    model = FloatCModel(e, single=True)
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

    inputs = (Input("x", -4.0, 4.0), Input("int", -4.0, 4.0))
    params = (Param("gain", 2.0, 0.0, 4.0),)
    states = (State("sum", -100.0, 100.0, "", 1.0),)
    outputs = (
        Output("sum"),
        Output("angle", "ht"),
        Output("limited"),
        Output("wrapped", "ht"),
        Output("larger"),
    )

    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = x.sum + p.gain * u.x
        return {"sum": total}, {
            "sum": total,
            "angle": ops.atan2_ht(u.x, u.int),
            "limited": ops.clip(u.x, -2.0, 3.0),
            "wrapped": ops.wrap_ht(u.x),
            "larger": ops.rsqrt(u.x),
        }


def test_parameters_states_reset() -> None:
    model = FloatCModel(Odd(), single=True, params={"gain": 0.5})
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
    assert FloatCModel(Odd(), single=True).update([[y, x]])[0, 1] == angle


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
    assert FloatCModel(Odd(), single=True).update([[x, 0.0]])[0, 2:4].tolist() == [limited, wrapped]


def test_root_of_nothing_is_finite() -> None:
    roots = FloatCModel(Odd(), single=True).update([[4.0, 0.0], [0.0, 0.0], [-1.0, 0.0]])[:, 4]
    assert roots[0] == 0.5
    assert roots[1] == roots[2] > 1e18


def test_shape_is_checked() -> None:
    with pytest.raises(ValueError, match=r"^inputs must have shape \(n, 2\), not \(2,\)$"):
        FloatCModel(Odd(), single=True).update([1.0, 2.0])


class Expressions(Estimator):
    """Expressions inside one another, and states that change places."""

    inputs = tuple(Input(name, -1.0, 1.0) for name in "xyz")
    states = (
        State("a", -1.0, 1.0, "", 0.25),
        State("b", -1.0, 1.0, "", -0.5),
        State("c", 0.0, 1.0),
    )
    outputs = tuple(Output(f"o{k}") for k in range(23))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        a, b, c = u.x, u.y, u.z
        either = ops.where((a < b) | (b < c) & (c < a), a, c)
        values = [
            *(a + b - c, a - (b + c), a - (b - c), a + (b + c), a * b + c, a * (b + c)),
            *(a / (2.0 + b * c), a / (2.0 + b) * c, -(a + b), a - -b * c, a - (-b + c)),
            ops.where(~(a < b), b, ops.where(b < c, a, c)) * a,
            *(either, ops.where(((a < b) | (b < c)) & (c < a), a, c)),
            ops.where((a < b) ^ (b < c), ops.named("n", ops.bounded(a, -1, 1, "")), -0.5),
            *(ops.flip(b < 0.0, a * c), ops.flip(b < c, -0.5), ops.absolute(a - b)),
            *(ops.maximum(a, b) - ops.minimum(b, c), ops.saturated(2.0 * a, 0.5)),
            *(ops.sincos_ht(a - b)[0], ops.exp(a) * ops.tanh(b), ops.asin_ht(ops.absolute(a * b))),
        ]
        after = {"a": x.b, "b": x.a, "c": x.c}
        outputs = {f"o{k}": v for k, v in enumerate(values)}
        return after, outputs | {"o2": x.a - (b - c) * x.b}


@pytest.mark.parametrize("single", [False, True])
def test_expressions_as_in_numpy(single: bool) -> None:
    rows = np.random.default_rng(1).uniform(-1.0, 1.0, (500, 3))
    rows = rows.astype(np.float32).astype(np.float64)
    wanted = numpy_float(Expressions(), rows[..., None])
    found = FloatCModel(Expressions(), single=single).update(rows)
    for k, values in enumerate(wanted.values()):
        assert found[:, k] == pytest.approx(values[:, 0], abs=4e-7 if single else 1e-15), k


@pytest.mark.parametrize("single", [False, True])
def test_constants_to_the_last_bit(single: bool) -> None:
    kind = np.float32 if single else np.float64
    numbers = np.random.default_rng(2).normal(size=40) * 10.0 ** np.arange(-20, 20)
    numbers[:4] = (1.0, -0.5, 1e-5, 1e5)

    class Constants(Estimator):
        inputs = (Input("x", -1.0, 1.0),)
        outputs = tuple(Output(f"o{k}") for k in range(len(numbers)))

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {f"o{k}": float(v) for k, v in enumerate(numbers)}

    found = FloatCModel(Constants(), single=single).update([[0.0]])[0]
    assert (found == numbers.astype(kind)).all()
