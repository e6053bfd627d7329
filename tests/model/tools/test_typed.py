"""Plain data become what the types say, or one error says where they do not."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Any

import pytest

from boresight.model.tools.typed import Malformed, Within, typed


class Colour(StrEnum):
    RED = "red"


@dataclass(frozen=True)
class Leaf:
    name: str
    bit: Annotated[int, Within(0, 31)] = 0


@dataclass(frozen=True)
class Tree:
    leaves: tuple[Leaf, ...]
    pair: tuple[int, str]
    colour: Colour = Colour.RED
    weight: float | None = None
    missing: float | str | None = None
    limit: Annotated[int | None, Within(-8, 7)] = None
    wet: bool = False
    notes: tuple[str, ...] = field(default_factory=tuple)


GOOD: dict[str, Any] = {"leaves": [{"name": "a"}], "pair": [1, "b"]}


def test_what_may_be_left_out_and_what_is_ignored() -> None:
    assert typed(Tree, {**GOOD, "more": 1}) == Tree((Leaf("a"),), (1, "b"))
    everything = {
        **{"leaves": [{"name": "a", "bit": 31}, {"name": "b"}], "pair": [-1, ""]},
        **{"colour": "red", "weight": 2, "missing": "hold", "limit": -8, "wet": True},
        "notes": ["x"],
    }
    assert typed(Tree, everything) == Tree(
        (Leaf("a", 31), Leaf("b")), (-1, ""), Colour.RED, 2, "hold", -8, True, ("x",)
    )
    assert typed(Tree, {**GOOD, "weight": None, "missing": 0.5, "limit": None}).missing == 0.5


@pytest.mark.parametrize(
    ("data", "place", "value"),
    [
        ([], "", []),
        ({}, ", leaves", None),
        ({**GOOD, "leaves": {}}, ", leaves", {}),
        ({**GOOD, "leaves": [1]}, ", leaves[0]", 1),
        ({**GOOD, "leaves": [{"name": "a"}, {"bit": 1}]}, ", leaves[1], name", None),
        ({**GOOD, "leaves": [{"name": "a", "bit": 32}]}, ", leaves[0], bit", 32),
        ({**GOOD, "leaves": [{"name": "a", "bit": -1}]}, ", leaves[0], bit", -1),
        ({**GOOD, "leaves": [{"name": "a", "bit": True}]}, ", leaves[0], bit", True),
        ({**GOOD, "leaves": [{"name": "a", "bit": 1.0}]}, ", leaves[0], bit", 1.0),
        ({**GOOD, "pair": [1, "b", 2]}, ", pair", [1, "b", 2]),
        ({**GOOD, "pair": [1, 2]}, ", pair[1]", 2),
        ({**GOOD, "colour": "blue"}, ", colour", "blue"),
        ({**GOOD, "colour": None}, ", colour", None),
        ({**GOOD, "weight": "1"}, ", weight", "1"),
        ({**GOOD, "weight": True}, ", weight", True),
        ({**GOOD, "missing": []}, ", missing", []),
        ({**GOOD, "limit": 8}, ", limit", 8),
        ({**GOOD, "wet": 1}, ", wet", 1),
        ({**GOOD, "notes": "ab"}, ", notes", "ab"),
    ],
)
def test_the_place_of_what_does_not_fit(data: Any, place: str, value: Any) -> None:
    with pytest.raises(Malformed) as error:
        typed(Tree, data)
    assert (error.value.location, error.value.value) == (place, value)
