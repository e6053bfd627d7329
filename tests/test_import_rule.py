"""Imports run one way below one name: model <- gateware, firmware <- sim <- boresight's front."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("model", "gateware", "firmware", "sim")
MAY = {
    "model": {"model"},
    "gateware": {"gateware", "model"},
    "firmware": {"firmware", "model"},
    "sim": {"sim", "gateware", "firmware", "model"},
    "boresight": {"front", "sim", "gateware", "firmware", "model"},
}


def modules(path: Path) -> set[str]:
    """Full names of all modules that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            module = node.module or ""
            names |= (
                {f"{module}.{a.name}" for a in node.names} if module == "boresight" else {module}
            )
    return names


def rooms(path: Path) -> set[str]:
    """Our rooms that a file imports from; ``front`` is what lies in none of them."""
    parts = [name.split(".") for name in modules(path)]
    inside = {p[1] if len(p) > 1 else "front" for p in parts if p[0] == "boresight"}
    return {room if room in ROOMS else "front" for room in inside}


def files_of(folder: str) -> list[Path]:
    """Python files below a top folder, without what links lead to."""
    found = [
        path
        for path in (ROOT / folder).rglob("*.py")
        if not any(parent.is_symlink() for parent in path.parents)
    ]
    assert found
    return found


@pytest.mark.parametrize("folder", MAY)
def test_import_rule(folder):
    for path in files_of(folder):
        wrong = rooms(path) - MAY[folder]
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize("folder", [*MAY, "tests"])
def test_one_import_name(folder):
    for path in files_of(folder):
        wrong = {name.split(".")[0] for name in modules(path)} & {*ROOMS}
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)} without boresight."


@pytest.mark.parametrize("folder", [*MAY, "tests"])
def test_instruments_are_for_tests(folder):
    shared = (["tests", "support"], ["tests", "mutants"])
    for path in files_of(folder):
        wrong = {name for name in modules(path) if name.split(".")[0] == "tests"}
        if folder == "tests":  # tests share what stands in `tests.support`, not each other
            wrong = {name for name in wrong if name.split(".")[:2] not in shared}
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


@pytest.mark.parametrize("folder", MAY)
def test_imports_are_absolute(folder):
    for path in files_of(folder):
        tree = ast.walk(ast.parse(path.read_text()))
        assert not any(isinstance(node, ast.ImportFrom) and node.level for node in tree), path


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_are_links(room):
    link = ROOT / "boresight" / room
    assert link.is_symlink() and link.readlink() == Path("..") / room


def test_model_needs_numpy_only():
    standard = set(sys.stdlib_module_names)
    for path in files_of("model"):
        top = {name.split(".")[0] for name in modules(path)}
        assert top <= standard | {"boresight", "numpy"}, path


def test_the_package_alone_is_cheap():
    code = "import sys, boresight; print([m for m in sys.modules if m in ('numpy', 'amaranth')])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
