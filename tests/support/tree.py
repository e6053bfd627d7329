"""The tree of sources as its tests of structure see it: files, modules, what imports what."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Folders of the package's own sources.
SOURCES = ("boresight", "model", "gateware", "firmware", "sim", "systems")


def python_files(folder: str, root: Path = ROOT) -> list[Path]:
    """Python files below a top folder, without what links lead to."""
    files = [
        path
        for path in sorted((root / folder).rglob("*.py"))
        if not any(parent.is_symlink() for parent in path.parents)
    ]
    assert files, f"no Python below {folder}"
    return files


@cache
def _parsed(text: str) -> ast.Module:
    return ast.parse(text)


def imports(path: Path) -> set[str]:
    """Full names of all that a file imports, wherever it does; of a package, what is taken."""
    names = set()
    for node in ast.walk(_parsed(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def modules_of(root: Path = ROOT) -> dict[str, Path]:
    """Our modules by name below ``boresight``; a package has the name of its folder."""
    results = {}
    for folder in SOURCES:
        for path in python_files(folder, root):
            parts = path.relative_to(root).with_suffix("").parts
            parts = parts[:-1] if parts[-1] == "__init__" else parts
            results[".".join(parts if folder == "boresight" else ("boresight", *parts))] = path
    return results


def room_of(module: str, path: Path) -> str:
    """A folder without sub-folders is a room; elsewhere each module is one of its own."""
    inner = [p for p in path.parent.iterdir() if p.is_dir() and p.name != "__pycache__"]
    if any(any(p.rglob("*.py")) for p in inner):
        return module
    return module if path.name == "__init__.py" else module.rpartition(".")[0]


def circles(modules: Mapping[str, Path], *, rooms: bool) -> list[tuple[str, ...]]:
    """Modules, or rooms, that import each other round a circle: one sorted group for each.

    Parameters
    ----------
    modules : mapping of str to Path
        As `modules_of` gives them.
    rooms : bool
        Among rooms instead of modules.
    """
    name = {m: room_of(m, path) if rooms else m for m, path in modules.items()}
    edges: dict[str, set[str]] = defaultdict(set)
    for module, path in modules.items():
        for taken in imports(path):
            target = taken if taken in modules else taken.rpartition(".")[0]
            if target in modules and name[target] != name[module]:
                edges[name[module]].add(name[target])
    reached = {start: _reached(start, edges) for start in list(edges)}
    groups = {
        tuple(sorted(b for b in beyond if a in reached.get(b, ())))
        for a, beyond in reached.items()
        if a in beyond
    }
    return sorted(groups)


def _reached(start: str, edges: Mapping[str, set[str]]) -> set[str]:
    seen: set[str] = set()
    todo = [start]
    while todo:
        for other in edges.get(todo.pop(), set()) - seen:
            seen.add(other)
            todo.append(other)
    return seen
