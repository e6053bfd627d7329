"""Levels by name."""

from __future__ import annotations

from boresight.model.errors import require, require_choice
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat, NumpyFloat
from boresight.sim.levels.integer import Emitted, Interpreted
from boresight.sim.levels.level import Level
from boresight.sim.levels.rtl import Simulated

#: Float64 with numpy and compiled, integer interpreter, C, Verilog.
LEVELS: dict[str, type[Level]] = {
    kind.name: kind for kind in (NumpyFloat, CompiledFloat, Interpreted, Emitted, Simulated)
}


def make_level(name: str, build: Build, runs: int | None = None) -> Level:
    """Make a level; with ``runs``, which "c" alone takes, that many runs side by side."""
    require_choice("level", name, LEVELS)
    if runs is None:
        return LEVELS[name](build)
    require(name == "c", "level", "c, which has runs side by side", name, "choose it")
    return Emitted(build, runs=runs)
