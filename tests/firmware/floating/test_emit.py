"""The float C and its expressions."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.floating.emit import emit_float_c
from boresight.firmware.floating.text import Expressions
from boresight.model import ops
from boresight.model.attitude import ESTIMATORS, estimator
from boresight.model.lowering.trace import Trace, Tracer
from tests.support.estimators import ALL

# -- the float C: strict compilers accept it, and it is as a person would write it ----------------

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
def test_no_warning(name: str, tmp_path: Path) -> None:
    for file, text in emit_float_c(ALL[name]()).items():
        (tmp_path / file).write_text(text)
    subprocess.run(
        ["gcc", *STRICT, "-O2", "-c", f"{name}_float.c", "-o", "x.o"], cwd=tmp_path, check=True
    )


@pytest.mark.parametrize("name", sorted(ALL))
def test_single_precision_only(name: str) -> None:
    source = emit_float_c(ALL[name]())[f"{name}_float.c"]
    code = re.sub(r"//.*|/\*[\s\S]*?\*/", "", source)
    assert "double" not in code
    assert not re.search(r"(?<![\w.])\d+\.\d+(?!\d*f|\d*e)", code)
    assert not re.search(r"\b(sin|cos|sqrt|atan2|asin|fabs|floor)\(", code)
    assert max(map(len, source.splitlines())) <= 100


def test_interface_is_that_of_the_integer_c() -> None:
    from boresight.firmware.emit import emit_c

    e = estimator("mekf")
    integer = emit_c(e.compile())["mekf.h"]
    single = emit_float_c(e)["mekf_float.h"]

    def members(text: str, kind: str) -> list[str]:
        body = re.search(rf"(?s)typedef struct {{([^}}]*)}} mekf(?:_float)?{kind}_t;", text)
        assert body
        return re.findall(r"(?:int32_t|float) (\w+);", body[1])

    for kind in ("_params", "_state", "_in", "_out"):
        assert members(single, kind) == members(integer, kind)
    for function in ("init", "reset", "update"):
        assert f"void mekf_float_{function}(" in single


def test_same_estimator_same_text() -> None:
    assert emit_float_c(estimator("ekf_bias")) == emit_float_c(estimator("ekf_bias"))


# -- float expressions as C text: constants to the last bit, brackets where they matter -----------


def leaves(*names: str) -> list:
    tracer = Tracer("test")
    return [tracer.leaf("input", name, -1.0, 1.0) for name in names]


def written(outputs: dict, states: tuple = ()) -> list[str]:
    """All statements that compute outputs and states."""
    expressions = Expressions(Trace(next(iter(outputs.values())).tracer, (), outputs, (), states))
    return [*expressions.statements(), *expressions.results()]


def text_of(make) -> str:
    """The expression that the value ``make(x, y, z)`` becomes, and variables for flips."""
    *variables, result = written({"out": make(*leaves(*"xyz"))})
    known = dict(re.fullmatch(r"const \w+ (\w+) = (.*);", line).groups() for line in variables)
    text = result.removeprefix("out->out = ").removesuffix(";")
    return known.get(text, text).replace("in->", "").replace("_i", "")


@pytest.mark.parametrize(
    ("make", "wanted"),
    [
        (lambda x, y, z: x + y - z, "x + y - z"),
        (lambda x, y, z: x - (y + z), "x - (y + z)"),
        (lambda x, y, z: x - (y - z), "x - (y - z)"),
        (lambda x, y, z: x + (y + z), "x + (y + z)"),
        (lambda x, y, z: x * y + z, "x * y + z"),
        (lambda x, y, z: x * (y + z), "x * (y + z)"),
        (lambda x, y, z: x / (y * z), "x / (y * z)"),
        (lambda x, y, z: x / y * z, "x / y * z"),
        (lambda x, y, z: -(x + y), "-(x + y)"),
        (lambda x, y, z: ops.where(x < y, y, z), "x < y ? y : z"),
        (lambda x, y, z: ops.where(x < y, y, z) * x, "(x < y ? y : z) * x"),
        (
            lambda x, y, z: ops.where(~(x < y), y, ops.where(y < z, x, z)),
            "!(x < y) ? y : (y < z ? x : z)",
        ),
        (
            lambda x, y, z: ops.where((x < y) | (y < z) & (z < x), x, z),
            "x < y || (y < z && z < x) ? x : z",
        ),
        (
            lambda x, y, z: ops.where(((x < y) | (y < z)) & (z < x), x, z),
            "(x < y || y < z) && z < x ? x : z",
        ),
        (lambda x, y, z: ops.clip(x, -1.0, 2.0), "clamp(x, -1.0f, 2.0f)"),
        (lambda x, y, z: ops.absolute(x - y), "fabsf(x - y)"),
        (lambda x, y, z: ops.sqrt(x), "sqrtf(x)"),
        (lambda x, y, z: ops.rsqrt(x), "1.0f / sqrtf(larger(x, 1.1754944e-38f))"),
        (lambda x, y, z: ops.wrap_ht(x), "wrap_half_turns(x)"),
        (lambda x, y, z: x + -y, "x - y"),
        (lambda x, y, z: x - -y * z, "x + y * z"),
        (lambda x, y, z: x - 0.5 * -y, "x + y * 0.5f"),
        (lambda x, y, z: y * z + -0.25, "y * z - 0.25f"),
        (lambda x, y, z: x - (-y + z), "x - (-y + z)"),
        (lambda x, y, z: ops.flip(y < 0.0, x), "y < 0.0f ? -x : x"),
        (lambda x, y, z: ops.flip(y < 0.0, x * z), "y < 0.0f ? -t5 : t5"),
        (lambda x, y, z: ops.flip(y < z, -0.5), "y < z ? -(-0.5f) : (-0.5f)"),
        (lambda x, y, z: ops.saturated(x, 2.0), "clamp(x, -2.0f, 2.0f)"),
        (lambda x, y, z: ops.maximum(x, y) - ops.minimum(y, z), "larger(x, y) - smaller(y, z)"),
        (lambda x, y, z: ops.named("n", ops.bounded(x, -1, 1, "")) * 2, "x * 2.0f"),
        (lambda x, y, z: ops.sincos_ht(x - y)[0], "sinf(3.1415927f * (x - y))"),
        (lambda x, y, z: ops.sincos_ht(x * y)[1] * z, "cosf(3.1415927f * (x * y)) * z"),
        (lambda x, y, z: ops.atan2_ht(y, x), "wrap_half_turns(0.31830987f * arc_tangent(y, x))"),
        (lambda x, y, z: ops.asin_ht(x), "0.31830987f * asinf(clamp(x, 0.0f, 1.0f))"),
    ],
)
def test_brackets(make, wanted: str) -> None:
    assert text_of(make) == wanted


def test_used_twice_gets_a_variable() -> None:
    (x,) = leaves("x")
    double = x + ops.bounded(x, -1.0, 1.0, "")
    state = x.tracer.leaf("state", "s", 0.0, 1.0)
    assert written(
        {"o": double, "same": ops.named("n", double)}, ((state, 0.0, double * double),)
    ) == [
        "const float x_i = in->x;",
        "const float o = x_i + x_i;",
        "out->o = o;",
        "out->same = o;",
        "self->state.s = o * o;",
    ]


def test_a_state_that_stays_is_not_written() -> None:
    (x,) = leaves("x")
    state = x.tracer.leaf("state", "s", 0.0, 1.0)
    assert written({"o": state}, ((state, 0.0, state),))[1:] == [
        "out->o = s_s;",
        "self->state.s = s_s;",
    ]
    assert written({"o": x}, ((state, 0.0, state),)) == ["out->o = in->x;"]


def test_states_that_change_places() -> None:
    (x,) = leaves("x")
    a, b = (x.tracer.leaf("state", name, 0.0, 1.0) for name in "ab")
    assert written({"o": x}, ((a, 0.0, b), (b, 0.0, a))) == [
        "out->o = in->x;",
        "const float b_next = self->state.a;",
        "self->state.a = self->state.b;",
        "self->state.b = b_next;",
    ]


@pytest.mark.parametrize("name", ["in", "self", "clamp", "sin", "sinf", "x_i"])
def test_variables_hide_nothing(name: str) -> None:
    (x,) = leaves("x")
    lines = written({name: x + x, "y": (x + x) * x})
    assert lines[1] == "const float t1 = x_i + x_i;"


def test_variables_differ() -> None:
    (x,) = leaves("x")
    square = (x + x) * (x + x)
    assert square.number == 2
    assert written({"t2": x + x, "y": square - square})[1:4] == [
        "const float t2 = x_i + x_i;",
        "const float t2_ = t2 * t2;",
        "out->t2 = t2;",
    ]


def test_functions_stay_functions() -> None:
    text = emit_float_c(ESTIMATORS["complementary"]())["complementary_float.c"]
    counts = [len(re.findall(rf"\b{name}f\(", text)) for name in ("sin", "cos", "asin")]
    assert counts == [3, 3, 1]
