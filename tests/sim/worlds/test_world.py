"""Names of worlds, and worlds without draws."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.sim.worlds.world import World


def test_a_world_without_draws_says_so() -> None:
    class Plain(World):
        pass

    assert Plain().bound() == {}
    with pytest.raises(InputError, match="^world plain: wanted a world with draws, found none for"):
        Plain().draw(3)
