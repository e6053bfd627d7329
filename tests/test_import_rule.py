"""Imports run one way below one name: model <- gateware, firmware <- sim <- boresight's front.

`systems` takes what the documentation offers to users
(`tests/systems/test_public_names.py`), and nothing imports it.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.verbs import VERBS
from tests.support.tree import ROOT, imports, python_files

ROOMS = ("model", "gateware", "firmware", "sim", "systems")
MAY = {
    "model": {"model"},
    "gateware": {"gateware", "model"},
    "firmware": {"firmware", "model"},
    "sim": {"sim", "gateware", "firmware", "model"},
    "boresight": {"front", "sim", "gateware", "firmware", "model"},
    "systems": {"systems", "front", "sim", "model"},
}


def rooms(path: Path) -> set[str]:
    """Our rooms that a file imports from; ``front`` is what lies in none of them."""
    parts = [name.split(".") for name in imports(path)]
    inside = {p[1] if len(p) > 1 else "front" for p in parts if p[0] == "boresight"}
    return {room if room in ROOMS else "front" for room in inside}


@pytest.mark.parametrize("folder", MAY)
def test_import_rule(folder):
    for path in python_files(folder):
        wrong = rooms(path) - MAY[folder]
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


def test_verbs_import_no_verbs():
    modules = tuple(f"boresight.{place}." for place in VERBS.values())
    for place in VERBS.values():
        path = ROOT / "boresight" / f"{place.replace('.', '/')}.py"
        assert not [name for name in imports(path) if name.startswith(modules)], path


@pytest.mark.parametrize("folder", [*MAY, "tests"])
def test_one_import_name(folder):
    for path in python_files(folder):
        wrong = {name.split(".")[0] for name in imports(path)} & {*ROOMS}
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)} without boresight."


@pytest.mark.parametrize("folder", [*MAY, "tests"])
def test_instruments_are_for_tests(folder):
    for path in python_files(folder):
        wrong = {name for name in imports(path) if name.split(".")[0] == "tests"}
        if folder == "tests":  # tests share what stands in `tests.support`, not each other
            wrong = {name for name in wrong if name.split(".")[1:2] != ["support"]}
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize("folder", [folder for folder in MAY if folder != "systems"])
def test_the_toolkit_imports_neither_the_attitude_system_nor_systems(folder):
    for path in python_files(folder):
        if "attitude" in path.parent.relative_to(ROOT).parts:
            continue
        parts = [name.split(".") for name in imports(path)]
        wrong = {".".join(p) for p in parts if p[0] == "boresight" and p[2:3] == ["attitude"]}
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize("folder", MAY)
def test_imports_are_absolute(folder):
    for path in python_files(folder):
        tree = ast.walk(ast.parse(path.read_text()))
        assert not any(isinstance(node, ast.ImportFrom) and node.level for node in tree), path


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_are_links(room):
    link = ROOT / "boresight" / room
    assert link.is_symlink() and link.readlink() == Path("..") / room


def test_nothing_but_the_package_is_on_the_path_of_an_editable_install():
    (link,) = (p for p in (ROOT / ".src").iterdir() if p.suffix != ".egg-info")
    assert link.name == "boresight" and link.readlink() == Path("..") / "boresight"


def test_model_needs_few_libraries():
    standard = set(sys.stdlib_module_names)
    for path in python_files("model"):
        top = {name.split(".")[0] for name in imports(path)}
        # mpmath: constants and tables to the last bit, which numpy does not promise; pint: units;
        # filelock: output files and the build cache.
        libraries = {"rounded.py": "mpmath", "units.py": "pint"}
        libraries |= {"files.py": "filelock", "cache.py": "filelock"}
        more = {libraries[path.name]} if path.name in libraries else set()
        assert top <= standard | {"boresight", "numpy"} | more, path


def test_imports_are_cheap():
    code = """
import sys, boresight
print([m for m in ("numpy", "amaranth") if m in sys.modules])
import boresight.model.attitude.front, boresight.verbs.check
from boresight.model.resolve import ESTIMATOR_GROUP, estimator_of, names_of_entry_points
print(len([estimator_of(name) for name in names_of_entry_points(ESTIMATOR_GROUP)]) > 4)
print([m for m in ("amaranth", "matplotlib", "pint", "pymap3d", "scipy") if m in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[]\nTrue\n[]\n", done.stderr
