"""Levels by name."""

from __future__ import annotations

from boresight.model.errors import require_choice
from boresight.sim.levels import floating, integer, rtl
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level

#: Float64 with numpy and compiled, integer interpreter, C, Verilog.
LEVELS: dict[str, type[Level]] = {
    level.name: level for module in (floating, integer, rtl) for level in module.LEVELS
}


def level_of(name: str) -> type[Level]:
    """Return the level with a name; raises InputError for unknown names."""
    require_choice("level", name, LEVELS)
    return LEVELS[name]


def make_level(name: str, build: Build, runs: int | None = None) -> Level:
    """Make a level; with ``runs``, that many runs side by side (`Level.batch`).

    Raises
    ------
    InputError
        Unknown level or configuration, or an estimator that fixed point cannot hold.
    ToolMissing
        A compiler or simulator is not installed.
    """
    kind = level_of(name)
    return kind(build) if runs is None else kind.batch(build, runs)
