"""Imports run one way below one name: model <- gateware, firmware <- sim <- boresight's front.

Nothing imports `systems`, and the toolkit does not import the attitude system.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.tree import ROOT, imports, python_files

ROOMS = ("model", "gateware", "firmware", "sim", "systems")
MAY = {
    "model": {"model"},
    "gateware": {"gateware", "model"},
    "firmware": {"firmware", "model"},
    "sim": {"sim", "gateware", "firmware", "model"},
    "boresight": {"front", "sim", "gateware", "firmware", "model"},
    "systems": {"systems", "front", "sim", "model"},
    "tests": {"tests", "front", *ROOMS},
}


def rooms(path: Path) -> set[str]:
    """Rooms that a file imports from; ``front`` is `boresight` without the others."""
    found = set()
    for name in imports(path):
        top, *rest = name.split(".")
        if top == "boresight":
            found.add(rest[0] if rest and rest[0] in ROOMS else "front")
        elif top == "tests":  # tests share `tests.support` alone
            found.add("tests" if rest[0] == "support" else name)
        elif not top:
            found.add("tests" if ROOT / "tests" in path.parents else "relative names")
        elif top in ROOMS:
            found.add(f"{top} without boresight")
    return found


@pytest.mark.parametrize("folder", MAY)
def test_import_rule(folder: str) -> None:
    for path in python_files(folder):
        wrong = rooms(path) - MAY[folder]
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize("folder", ["model", "gateware", "firmware", "sim", "boresight"])
def test_the_toolkit_does_not_import_the_attitude_system(folder: str) -> None:
    for path in python_files(folder):
        if "attitude" not in path.parent.relative_to(ROOT).parts:
            wrong = [name for name in imports(path) if name.split(".")[2:3] == ["attitude"]]
            assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


def test_imports_are_cheap() -> None:
    code = """
import sys, boresight
print([m for m in ("numpy", "amaranth") if m in sys.modules])
import boresight.verbs.check
from boresight.model.resolve import ESTIMATOR_GROUP, estimator_of, names_of_entry_points
print(len([estimator_of(name) for name in names_of_entry_points(ESTIMATOR_GROUP)]) > 4)
print([m for m in ("amaranth", "matplotlib", "pint", "pymap3d", "scipy") if m in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[]\nTrue\n[]\n", done.stderr
