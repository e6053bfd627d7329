"""Answers: fields as plain data, and as tables for a notebook."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from boresight.sim.answer import Answer, plain


class Pair(NamedTuple):
    a: float
    b: float


@dataclass(frozen=True)
class Row:
    name: str
    value: float


@dataclass(frozen=True)
class Told(Answer):
    good: bool
    count: int
    rows: tuple[Row, ...]
    named: Mapping[str, Row]
    limits: Mapping[str, float]
    curve: np.ndarray = field(default_factory=lambda: np.array([1.0, math.inf]))


TOLD = Told(True, 12345, (Row("<a>", 0.5), Row("b", math.nan)), {"x": Row("c", 2.0)}, {"k": 0.25})


def test_plain_data_of_every_kind() -> None:
    assert plain([Pair(1.0, math.inf), Path("a/b"), None, "text"]) == [
        {"a": 1.0, "b": None},
        "a/b",
        None,
        "text",
    ]
    assert plain({1: np.float64(np.nan), "n": np.int64(3), "yes": np.bool_(True)}) == {
        "1": None,
        "n": 3,
        "yes": True,
    }
    assert plain(np.array([[1, 2], [3, 4]])) == [[1, 2], [3, 4]]
    assert plain(x for x in (1, 2.5)) == [1, 2.5]
    assert plain(TOLD) == TOLD.to_json()
    with pytest.raises(TypeError, match="nothing for complex"):
        plain(1j)


def test_fields_in_their_order() -> None:
    data = TOLD.to_json()
    assert list(data) == ["good", "count", "rows", "named", "limits", "curve"]
    assert data["rows"] == [{"name": "<a>", "value": 0.5}, {"name": "b", "value": None}]
    assert data["named"] == {"x": {"name": "c", "value": 2.0}}
    assert data["curve"] == [1.0, None]
    json.dumps(data, allow_nan=False)


def test_tables_of_a_notebook() -> None:
    page = TOLD._repr_html_()
    assert "<th>Told</th>" in page and "<td>count</td><td>12,345</td>" in page
    assert "<h4>rows</h4>" in page and "<th>name</th><th>value</th>" in page
    assert "<td>&lt;a&gt;</td><td>0.5</td>" in page and "<a>" not in page
    assert "<td>b</td><td></td>" in page  # no number
    assert "<td>x</td><td>c</td><td>2</td>" in page
    assert "<td>k</td><td>0.25</td>" in page
    assert "curve" not in page


@dataclass(frozen=True)
class Nested:
    name: str
    mean: Mapping[str, float] | None
    curve: tuple[float, ...]
    nothing: None = None


def test_objects_in_a_row_are_columns_of_it() -> None:
    rows = (Nested("a", {"pos": 0.5}, (1.0,)), Nested("b", None, (2.0,)))
    page = Told(True, 1, rows, {}, {})._repr_html_()  # type: ignore[arg-type]
    assert "<th>name</th><th>mean pos</th></tr>" in page
    assert "<td>a</td><td>0.5</td>" in page and "<td>b</td><td></td>" in page
