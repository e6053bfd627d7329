"""The base class of closed loops; test_loop.py runs worlds on every level."""

from __future__ import annotations

import pytest

from boresight.sim.worlds.world import World


class Mixer(World):
    pass


class Other(Mixer):
    name = "my world"


class Third(Other):
    pass


def test_a_world_has_the_name_of_its_class_unless_it_says_so() -> None:
    assert [w.name for w in (World, Mixer, Other, Third)] == ["world", "mixer", "my world", "third"]


def test_what_has_to_be_written() -> None:
    Mixer().start()
    with pytest.raises(NotImplementedError):
        Mixer().record(None)
