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
from boresight.model.blocks.biquad import Cascade
from boresight.model.kalman.slopes import Slopes
from boresight.model.recorded import evaluate
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
    measured = sum(len(op.terms) for op in made.program.ops)
    length = build_core(made.program, "small").schedule.length
    assert (measured, length) == (int(products), int(cycles)), "products, cycles"


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
