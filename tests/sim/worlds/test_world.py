"""Names of worlds, and worlds without draws."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.sim.worlds.world import World


class Plant(World):
    pass


class Called(Plant):
    name = "mine"


class Again(Called):
    pass


def test_names_of_worlds() -> None:
    assert [w.name for w in (World, Plant, Called, Again)] == ["world", "plant", "mine", "again"]


def test_a_world_without_draws_says_so() -> None:
    class Plain(World):
        pass

    assert Plain().bound() == {}
    with pytest.raises(InputError, match="^world plain: wanted a world with draws, found none for"):
        Plain().draw(3)
