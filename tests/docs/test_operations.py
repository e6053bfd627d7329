"""The page on operations: every line of its table is measured, its example runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

import boresight
from boresight import blocks, ops
from boresight.gateware.core import build_core
from boresight.model.blocks import Cascade
from boresight.model.kalman.slopes import Slopes
from boresight.model.recorded import evaluate
from boresight.model.words.fixed import Arithmetic
from tests.support.traced import Traced

PAGE = (Path(__file__).parents[2] / "docs" / "operations.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in row.strip("|").split("|")]
    for row in re.findall(r"^\| `.*` \|.*\|$", PAGE[: PAGE.index("## Blocks")], re.M)
]
RANGES = [(-1.0, 1.0), (0.5, 2.0)]


def function_of(row: list[str]) -> Any:
    return eval(f"lambda x, y: {row[0][1:-1]}", {"ops": ops, "blocks": blocks})


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_what_is_recorded_has_values_and_derivatives(row: list[str]) -> None:
    """`check` compares a recorded step with numpy; Kalman filters derive it."""
    made = Traced(function_of(row), RANGES)
    x, y = np.random.default_rng(0).uniform(*np.transpose(RANGES), (50, 2)).T
    recorded = evaluate(made.trace, {("input", "x0"): x, ("input", "x1"): y})
    assert recorded[made.nodes[0].number] == pytest.approx(np.asarray(function_of(row)(x, y)))
    slopes = Slopes(made.graph)
    slopes.seed(made.leaves[0], 0)
    assert slopes.of(made.nodes[0]).keys() <= {0}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_line_of_the_table(row: list[str]) -> None:
    _, _, error, products, cycles = row
    made = Traced(function_of(row), RANGES)
    rng = np.random.default_rng(0)
    ends = np.array(RANGES)[:, [0, 0, 1, 1]]
    ends[1] = ends[1, [0, 2, 0, 2]]
    points = np.concatenate([[rng.uniform(*r, 20_000) for r in RANGES], ends], axis=1)
    fixed, floats, saturated = made.run(*points)
    deviation = np.abs(fixed[0] - floats[0]).max()
    assert not saturated.any()
    assert 0.5 * float(error) <= deviation <= float(error), f"measured {deviation:.1e}"
    assert cost(made) == (int(products), int(cycles)), "products, cycles"


def cost(traced: Traced) -> tuple[int, int]:
    """Products, and cycles of a core that computes nothing else."""
    products = sum(len(op.terms) for op in traced.program.ops)
    return products, build_core(traced.program, "small").schedule.length


def test_costs_in_the_text() -> None:
    products, cycles = cost(Traced(ops.atan2_ht, [UNIT, UNIT]))
    assert f"two inputs in [-1, 1], takes {products} products and {cycles} cycles" in PAGE
    products, _ = cost(Traced(ops.exp, [(0.7, 1.38)]))
    assert f"results in one binade, such as [2, 4), takes {products} products" in PAGE


UNIT = (-1.0, 1.0)
#: What is computed besides each line of the table: expressions and ranges of x and y.
DOMAINS: dict[str, list[tuple[str, Any, Any]]] = {
    "x + y": [("x + y", (-1e3, 1e3), (-1e-3, 1e-3)), ("x - y", (-3.0, 5.0), (100.0, 200.0))],
    "x * y": [("x * y", (-1e3, 1e3), (-1e-3, 1e-3)), ("x * y", (0.0, 1.0), (-0.2, 0.1))],
    "x / y": [
        ("x / y", UNIT, (2.0**-18, 1.9)),
        ("x / y", (-1e3, 1e3), (-3.0, -1e-3)),
        ("1.0 / y", UNIT, (1e-3, 1e3)),
    ],
    "x**3": [(f"x**{n}", UNIT, UNIT) for n in (2, 3, 5, 8)]
    + [("x**5", (-3.0, 2.0), UNIT)]
    + [(f"y**-{n}", UNIT, (0.25, 4.0)) for n in (1, 2, 3)],
    "abs(x)": [("abs(x)", (-3.0, 7.0), UNIT), ("abs(y)", UNIT, (-1e3, 0.0))],
    "ops.where(x < y, x, y)": [("ops.where(x < y, x, y)", (-3.0, 7.0), UNIT)],
    "ops.flip(y < 1.0, x)": [("ops.flip(y < 1.0, x)", (-3.0, 7.0), (0.0, 100.0))],
    "ops.maximum(x, y)": [(f"ops.{f}(x, y)", (-3.0, 7.0), UNIT) for f in ("maximum", "minimum")],
    "ops.clip(x, -0.5, 0.5)": [
        ("ops.clip(x, -0.375, 0.75)", (-3.0, 7.0), UNIT),
        ("ops.clip(x, -(2.0**-10), 3.0 * 2.0**-10)", UNIT, UNIT),
    ],
    "ops.saturated(x, 0.5)": [
        (f"ops.saturated(x, {limit})", (-1e3, 1e3), UNIT) for limit in (2.0**-10, 4.0)
    ],
    "ops.wrap_ht(3.0 * x)": [("ops.wrap_ht(x)", (-1e3, 1e3), UNIT)],
    "ops.wrap_turns(x)": [("ops.wrap_turns(x)", (-1e3, 1e3), UNIT)],
    "ops.sincos_ht(x)[0]": [(f"ops.sincos_ht(x)[{k}]", (-1e3, 1e3), UNIT) for k in (0, 1)]
    + [("ops.sincos_ht(x)[0]", (0.0, 0.1), UNIT)],
    "ops.asin_ht(0.7 * abs(x))": [("ops.asin_ht(x)", (0.0, high), UNIT) for high in (0.7188, 0.01)],
    "ops.atan2_ht(x, y)": [
        ("ops.atan2_ht(x, y)", UNIT, UNIT),
        ("ops.atan2_ht(x, y)", (-1e3, 1e3), UNIT),
        ("ops.atan2_ht(x, y)", (-1e-3, 1e-3), (-1.0, 1e-4)),
        ("ops.atan2_ht(x, y)", (0.0, 3.0), (5.0, 100.0)),
    ],
    "ops.sqrt(y)": [("ops.sqrt(y)", UNIT, (0.0, high)) for high in (1e-3, 1.0, 1e3)],
    "x * ops.rsqrt(y)": [
        ("x * ops.rsqrt(y)", (-1e3, 1e3), (1e-3, 10.0)),
        ("ops.bounded(x * ops.rsqrt(y), -1024.0, 1024.0, '')", UNIT, (2.0**-20, 1.0)),
    ],
    "ops.exp(x)": [
        ("ops.exp(x)", ends, UNIT) for ends in ((-44.0, 44.0), (-3.0, 0.0), (-100.0, 0.5))
    ],
    "ops.log(y)": [("ops.log(y)", UNIT, ends) for ends in ((2.0**-31, 1.0), (1.0, 1e9))],
    "ops.tanh(2.0 * x)": [("ops.tanh(x)", (-high, high), UNIT) for high in (0.1, 20.0, 1e3)],
}
#: Lines whose error has in addition what one last bit of the arguments changes.
MOVES = ("x / y", "x**3", "where", "maximum", "sincos", "sqrt", "exp", "log", "interp")


def arguments(traced: Traced, n: int, rng: np.random.Generator) -> np.ndarray:
    """Arguments (2, n) that are words: even, over all magnitudes, near zero, at ends."""
    columns = []
    for leaf, number in zip(traced.leaves, traced.program.inputs, strict=True):
        (low, high), word = leaf.data[2:4], traced.program.format(number)
        kind = rng.integers(0, 10, n)
        short = (
            max(-low, high) * 2.0 ** rng.uniform(-word.word, 0.0, n) * rng.choice([-1.0, 1.0], n)
        )
        near = word.lsb * rng.integers(-40, 41, n)
        at_end = rng.choice([low, high, low + word.lsb, high - word.lsb, 0.5 * high], n)
        x = np.choose(
            np.digitize(kind, [4, 8, 9]), [rng.uniform(low, high, n), short, near, at_end]
        )
        columns.append(word.real(word.quantise(np.clip(x, low, high))))
    return np.array(columns)


def beyond_the_figure(row: list[str], case: int, word: int, n: int) -> float:
    """Largest error on a domain of a line, as a share of what the page allows."""
    text, figure = row[0][1:-1], float(row[2])
    expression, *ranges = [(text, *RANGES), *DOMAINS.get(text, [])][case]
    function = eval(f"lambda x, y: {expression}", {"ops": ops, "blocks": blocks})
    traced = Traced(function, ranges, word)
    points = arguments(traced, n, np.random.default_rng(word))
    least = 2.0 ** -Arithmetic(word=word).norm_max  # of full scale: what a word can normalise
    full = [max(-low, high) for low, high in ranges]
    legal = (points[1] >= ranges[1][0]) & (np.abs(points[1]) >= 2.0 * least * full[1])
    if any(name in text for name in ("/ y", "sqrt", "log")) or "y**-" in expression:
        points = points[:, legal]
    with np.errstate(all="ignore"):
        fixed, floats, saturated = traced.run(*points)
    assert not saturated.any()
    lsb, unit = (t.formats()[0].lsb for t in (traced, Traced(function_of(row), RANGES, word)))
    of_a_row = figure / Traced(function_of(row), RANGES, 32).formats()[0].lsb
    period = 1.0 if "wrap_turns" in text else 2.0 if "wrap" in text or "atan2" in text else np.inf
    allowed = of_a_row * max(lsb, unit) + np.zeros(points.shape[1])
    coarsest = max(traced.program.format(n).lsb for n in traced.program.inputs)
    if any(name in text for name in MOVES):
        for k, number in enumerate(traced.program.inputs):
            step = np.zeros((2, 1))
            step[k] = max(
                traced.program.format(number).lsb,
                coarsest * any(name in text for name in ("where", "maximum")),
                2.0 ** (1 - word) * ("sincos" in text),
            )
            with np.errstate(all="ignore"):
                moved = [np.abs(function(*(points + s)) - floats[0]) for s in (step, -step)]
            allowed += np.nan_to_num(np.maximum(*moved))
    error = np.abs(fixed[0] - floats[0])
    error = np.minimum(error, period - error)
    worst = np.argsort(error / np.maximum(allowed, 1e-300))[-20:]  # again, by mpmath
    exact = [float(function(*map(float, points[:, k]))) for k in worst]
    error = np.abs(fixed[0][worst] - exact)
    error = np.minimum(error, period - error)
    return float(np.max(error / np.maximum(allowed[worst], 1e-300), where=error > 0.0, initial=0.0))


@pytest.mark.parametrize(("low", "most"), [(2.0**-18, 2.0**-21), (2.0**-21, 2.0**-18)])
def test_quotients_of_a_divisor_that_spans_much(low: float, most: float) -> None:
    """The largest error relative to the quotient."""
    traced = Traced(lambda x, y: x / y, [UNIT, (low, 1.99)])
    y = low * np.random.default_rng(0).uniform(1.0, 2.0, 20_000)
    (fixed,), (quotient,), _ = traced.run(np.ones(20_000), y)
    assert 0.9 * most < np.max(np.abs(fixed / quotient - 1.0)) < most


CASES = [
    pytest.param(row, case, id=f"{row[0]}, {case}")
    for row in ROWS
    for case in range(1 + len(DOMAINS.get(row[0][1:-1], [])))
]


@pytest.mark.parametrize(("row", "case"), CASES)
def test_errors_on_all_domains_in_all_words(row: list[str], case: int) -> None:
    """In words of 32 bits, and of three other widths that differ from domain to domain."""
    number = ROWS.index(row) + 4 * case
    for word in (32, *(18 + (number + 5 * k) % 14 for k in range(3))):
        assert beyond_the_figure(row, case, word, 1500) <= 1.0, f"word {word}"


@pytest.mark.soak
@pytest.mark.parametrize("word", range(18, 33))
@pytest.mark.parametrize(("row", "case"), CASES)
def test_errors_of_a_million_arguments(row: list[str], case: int, word: int) -> None:
    assert beyond_the_figure(row, case, word, 1_000_000) <= 1.0


def test_every_function_is_in_the_table() -> None:
    documented = set(re.findall(r"\bops\.(\w+)", PAGE))
    assert set(ops.__all__) - documented <= {"absolute"}  # abs


def test_the_example(tmp_path: Path) -> None:
    (text,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    (tmp_path / "smooth.py").write_text(text)
    u = np.random.default_rng(1).uniform(-10.0, 10.0, 500)
    checked = boresight.check(str(tmp_path / "smooth.py"), {"u": u}, levels=("fixed", "c"))
    assert checked.good, str(checked)
    names: dict[str, Any] = {}
    exec(text, names)
    fine: Cascade = names["LOW_PASS"]
    assert round(fine.rounding) == 16
    assert Cascade.of(signal.butter(2, 0.02, output="sos"), 10.0).rounding == pytest.approx(
        140, abs=5
    )
