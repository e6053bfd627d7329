"""The tree of sources: its files, and what each imports."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]


def python_files(folder: str) -> list[Path]:
    """Python files below a top folder, without what links lead to."""
    files = [
        path
        for path in sorted((ROOT / folder).rglob("*.py"))
        if not any(parent.is_symlink() for parent in path.parents)
    ]
    assert files, f"no Python below {folder}"
    return files


def imports(path: Path) -> set[str]:
    """Full names of all that a file imports, wherever it does; of a package, what is taken."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            names |= {f"{module}.{alias.name}" for alias in node.names}
    return names
