"""The tree of sources as its tests of structure see it: files, modules, what imports what."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path

__all__ = [
    "ROOT",
    "SOURCES",
    "circles",
    "full_folders",
    "imports",
    "long_functions",
    "modules_of",
    "python_files",
    "room_of",
    "unmirrored",
]

ROOT = Path(__file__).parents[2]
#: Folders of the package's own sources.
SOURCES = ("boresight", "model", "gateware", "firmware", "sim")
#: Most loose files of a folder, most lines of a function without its docstring.
_FILES, _LINES = 15, 59


def _files(folder: Path) -> list[Path]:
    """All files below a folder, without what links lead to."""
    return [
        path
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and "__pycache__" not in path.parts
        and not any(parent.is_symlink() for parent in path.parents)
    ]


def python_files(folder: str, root: Path = ROOT) -> list[Path]:
    """Python files below a top folder, without what links lead to."""
    found = [path for path in _files(root / folder) if path.suffix == ".py"]
    assert found, f"no Python below {folder}"
    return found


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
    found = {}
    for folder in SOURCES:
        for path in python_files(folder, root):
            parts = path.relative_to(root).with_suffix("").parts
            parts = parts[:-1] if parts[-1] == "__init__" else parts
            found[".".join(parts if folder == "boresight" else ("boresight", *parts))] = path
    return found


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


def full_folders(root: Path = ROOT) -> dict[str, int]:
    """Folders with too many loose files beside ``__init__.py``, and how many."""
    count: dict[str, int] = defaultdict(int)
    for folder in SOURCES:
        for path in _files(root / folder):
            if path.name != "__init__.py":
                count[path.parent.relative_to(root).as_posix()] += 1
    return {folder: n for folder, n in count.items() if n > _FILES}


def long_functions(root: Path = ROOT) -> dict[str, int]:
    """Functions (``file: name``) with too many lines beside their docstring, and how many.

    The ``step`` of an estimator, which is its equations from first to last, is none of them.
    """
    found = {}
    for path in (p for folder in SOURCES for p in python_files(folder, root)):
        place = path.relative_to(root).as_posix()
        for node in ast.walk(_parsed(path.read_text())):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            lines = (node.end_lineno or 0) - node.lineno + 1
            if ast.get_docstring(node, clean=False) is not None:
                doc = node.body[0]
                lines -= (doc.end_lineno or 0) - doc.lineno + 1
            step = node.name == "step" and place.startswith("model/estimators/")
            if lines > _LINES and not step:
                found[f"{place}: {node.name}"] = lines
    return found


def unmirrored(root: Path = ROOT) -> list[str]:
    """Modules without a test of their own: ``a/b.py`` has tests/a/test_b.py or test_b_*.py.

    ``__main__.py`` has test_main.py. A package's ``__init__.py`` only says what it holds. Of a
    block's proofs tests/sim/formal/test_proofs.py proves each that a module's ``PROOFS`` holds.
    """
    found = []
    for path in (p for folder in SOURCES for p in python_files(folder, root)):
        place = path.relative_to(root)
        stem = re.sub(r"^__(\w+)__$", r"\1", place.stem)
        folder = root / "tests" / place.parent
        tests = [*folder.glob(f"test_{stem}.py"), *folder.glob(f"test_{stem}_*.py")]
        if place.parent.as_posix() == "sim/formal/blocks" and _has_proofs(path):
            tests += (root / "tests/sim/formal").glob("test_proofs.py")
        if place.name != "__init__.py" and not tests:
            found.append(place.as_posix())
    return found


def _has_proofs(path: Path) -> bool:
    return any(
        isinstance(name, ast.Name) and name.id == "PROOFS"
        for node in _parsed(path.read_text()).body
        if isinstance(node, ast.Assign)
        for name in node.targets
    )
