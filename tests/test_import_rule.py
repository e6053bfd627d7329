"""Imports run one way: model <- gateware, firmware <- sim <- boresight."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MAY = {
    "model": {"model"},
    "gateware": {"gateware", "model"},
    "firmware": {"firmware", "model"},
    "sim": {"sim", "gateware", "firmware", "model"},
    "boresight": {"boresight", "sim", "gateware", "firmware", "model"},
}


def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            names.add((node.module or "").split(".")[0])
    return names


@pytest.mark.parametrize("folder", MAY)
def test_import_rule(folder):
    files = list((ROOT / folder).rglob("*.py"))
    assert files
    for path in files:
        wrong = imported(path) & set(MAY) - MAY[folder]
        assert not wrong, f"{path.relative_to(ROOT)} imports {sorted(wrong)}"


def test_model_needs_numpy_only():
    import sys
    standard = set(sys.stdlib_module_names)
    for path in (ROOT / "model").rglob("*.py"):
        assert imported(path) <= standard | {"model", "numpy", "__future__"}, path
