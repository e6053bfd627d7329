"""Levels by name: one more is one more module."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import boresight.sim.levels
from boresight.model.errors import InputError
from boresight.model.estimators.complementary import Complementary
from boresight.sim.levels import registry
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import LEVELS, level_of, make_level

FIFTH = """
from boresight.sim.levels.integer import Emitted

class Netlist(Emitted):
    name, tools = "netlist", ("nextpnr",)

LEVELS = (Netlist,)
"""


def test_names() -> None:
    assert list(LEVELS) == ["numpy", "float", "fixed", "c", "rtl"]
    assert [n for n, level in LEVELS.items() if level.exact] == ["fixed", "c", "rtl"]
    assert all(level.tools for level in LEVELS.values())


def test_no_such_level() -> None:
    with pytest.raises(
        InputError,
        match=r"^level: wanted one of numpy, float, fixed, c, rtl, found 'vhdl'; choose one",
    ):
        make_level("vhdl", Build(Complementary()))


def test_a_fifth_level_is_one_more_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is found, run and checked as the others."""
    (tmp_path / "netlist.py").write_text(FIFTH)
    here = Path(registry.__file__).parent
    monkeypatch.setattr(boresight.sim.levels, "__path__", [str(here), str(tmp_path)])
    try:
        found = registry.all_levels()
    finally:
        sys.modules.pop("boresight.sim.levels.netlist", None)
    assert list(found) == ["numpy", "float", "fixed", "c", "netlist", "rtl"]
    assert level_of("c") is not found["netlist"]
    level = found["netlist"](Build(Complementary()))
    assert (level.name, level.tool) == ("netlist", "nextpnr")
    assert level.run(np.zeros((2, len(Complementary.inputs)))).words is not None
