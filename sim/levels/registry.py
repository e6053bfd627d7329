"""Levels by name, from the tuples ``LEVELS`` in the modules of this package."""

from __future__ import annotations

import importlib
import pkgutil

import boresight.sim.levels
from boresight.model.errors import require_choice
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level

__all__ = ["LEVELS", "level_of", "make_level"]


def all_levels() -> dict[str, type[Level]]:
    """All levels, in the order of their modules' names."""
    names = [m.name for m in pkgutil.iter_modules(boresight.sim.levels.__path__)]
    modules = [
        importlib.import_module(f"boresight.sim.levels.{name}")
        for name in sorted(names)
        if name != "registry"
    ]
    return {level.name: level for m in modules for level in getattr(m, "LEVELS", ())}


#: Float64 with numpy and compiled, integer interpreter, C, Verilog.
LEVELS: dict[str, type[Level]] = all_levels()


def level_of(name: str) -> type[Level]:
    """Return the level with a name; raises InputError for unknown names."""
    require_choice("level", name, LEVELS)
    return LEVELS[name]


def make_level(name: str, build: Build, number: int = 0, runs: int | None = None) -> Level:
    """Make a level; with ``runs``, that many runs side by side (`Level.batch`).

    Raises
    ------
    InputError
        Unknown level or configuration, or an estimator that fixed point cannot hold.
    ToolMissing
        A compiler or simulator is not installed.
    """
    kind = level_of(name)
    return kind(build, number) if runs is None else kind.batch(build, runs, number)
