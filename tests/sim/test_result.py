"""Results of verbs: plain data, text and a notebook's tables."""

import html
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from boresight.sim.result import Result, plain


class Pair(NamedTuple):
    a: float
    b: float


@dataclass(frozen=True)
class Limits:
    low: float
    path: Path


def test_plain_data_of_every_kind() -> None:
    values = [Pair(1.0, math.inf), Limits(0.5, Path("a/b")), None, "text"]
    assert plain(values) == [{"a": 1.0, "b": None}, {"low": 0.5, "path": "a/b"}, None, "text"]
    assert plain({1: np.float64(np.nan), "n": np.int64(3)}) == {"1": None, "n": 3}
    assert plain(np.array([[1, 2], [3, 4]])) == [[1, 2], [3, 4]]
    with pytest.raises(TypeError, match="complex"):
        plain(1j)


def test_a_result_as_data_text_and_html() -> None:
    rows = [{"output": "<v>", "max": 0.5, "unit": "m/s"}, {"output": "w", "max": math.nan}]
    result = Result({"n": 3, "curve": np.zeros(2)}, tables={"errors": rows}, notes=["odd"])
    assert result.good and result["n"] == 3 and [*result] == ["n", "curve"]
    data = result.to_json()
    assert data == {"good": True, "n": 3, "curve": [0.0, 0.0], "notes": ["odd"], "failures": []}
    json.dumps(data, allow_nan=False)
    text = str(result)
    assert [line.split() for line in text.splitlines() if "0.5" in line] == [["<v>", "0.5", "m/s"]]
    assert "warning: odd" in text and "FAILED" not in text
    assert result._repr_html_() == f"<pre>{html.escape(text)}</pre>"


def test_a_failure_is_the_last_line() -> None:
    result = Result({}, failures=["x differs", "y saturates"])
    assert not result.good
    assert str(result) == "FAILED: x differs; y saturates"
