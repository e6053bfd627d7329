"""What a world has without being told."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.worlds.world import Played, Streamed, World


class Plant(World):
    pass


class Called(Plant):
    name = "mine"


class Again(Called):
    pass


def test_names_of_worlds() -> None:
    assert [w.name for w in (World, Plant, Called, Again)] == ["world", "plant", "mine", "again"]


def test_a_world_has_no_start_of_its_own_and_no_record() -> None:
    assert Plant().start() is None
    with pytest.raises(NotImplementedError):
        Plant().record(None)


def test_a_world_without_draws_says_so() -> None:
    class Plain(World):
        pass

    assert Plain().bound() == {}
    with pytest.raises(InputError, match="^world plain: wanted a world with draws, found none for"):
        Plain().draw(3)


def test_played() -> None:
    """Each record once, whatever it is told; from the start again."""
    world = Played([{"a": 1.0}, {"a": 2.0}])
    for _ in range(2):
        world.start()
        told = [world.record(given) for given in (None, {"x": 9.0}, {"x": 9.0})]
        assert told == [{"a": 1.0}, {"a": 2.0}, None]


def test_streamed() -> None:
    """Rows of the pieces, one after the other; from the start again, whatever was left."""

    class Pieces(Streamed):
        def pieces(self):
            yield {"a": np.array([1.0, 2.0]), "b": np.array([3.0, 4.0])}
            yield {"b": np.array([6.0]), "a": np.array([5.0])}

    world = Pieces()
    world.start()
    assert world.record(None) == {"a": 1.0, "b": 3.0}
    world.start()
    rows = [{"a": 1.0, "b": 3.0}, {"a": 2.0, "b": 4.0}, {"a": 5.0, "b": 6.0}, None]
    assert [world.record({"x": 9.0}) for _ in rows] == rows
    with pytest.raises(NotImplementedError):
        Streamed().pieces()
