"""Identity of results beside their arguments: source files, with all imports, and versions.

An interrupted campaign continues only if this identity is unchanged.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import sys
import sysconfig
from collections.abc import Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from types import ModuleType

__all__ = ["identity"]


def identity(*things: object, packages: Sequence[str] = ()) -> str:
    """Digest of the source files of modules, classes and functions, and of all that they import.

    The digest covers the version of an installed distribution and the text of other files, but not
    Python's own modules. It includes imports inside functions, but not those for type checkers.

    Parameters
    ----------
    things : module, class, function or object
        An object stands for its class.
    packages : sequence of str
        Modules of installed distributions whose versions are included, imported or not.
    """
    working_folder = Path()
    names = [(name, working_folder) for name in (*map(_module_of, things), *packages)]
    parts: dict[str, str] = {}
    while names:
        name, folder = names.pop()
        if name in parts or name.partition(".")[0] in sys.stdlib_module_names:
            continue
        file = _file_of(name, folder)
        if file is None:
            parts[name] = ""
        elif _installed(file):
            parts[name.partition(".")[0]] = parts[name] = _version(name.partition(".")[0])
        else:
            text = file.read_bytes()
            parts[name] = hashlib.sha256(text).hexdigest()
            parent = name.rpartition(".")[0]
            imported = [*_imports(text, name if file.name == "__init__.py" else parent), parent]
            names += [(module, file.parent) for module in imported if module]
    return hashlib.sha256("\n".join(sorted({*parts.values()})).encode()).hexdigest()


def _module_of(thing: object) -> str:
    if isinstance(thing, ModuleType):
        return thing.__name__
    return str(getattr(thing, "__module__", None) or type(thing).__module__)


def _file_of(name: str, folder: Path) -> Path | None:
    """File of a module that a file in a folder imports; None if it is not found."""
    module = sys.modules.get(name)
    file = getattr(module, "__file__", None)
    if module is None and (folder / f"{name}.py").is_file():
        return folder / f"{name}.py"
    if module is None:
        try:
            spec = importlib.util.find_spec(name)
        except (ImportError, ValueError):  # a name in a module, not a module
            return None
        file = spec and spec.origin
    path = Path(file) if file else None
    return path if path is not None and path.suffix in (".py", ".so") and path.is_file() else None


def _installed(file: Path) -> bool:
    """Whether a file belongs to an installed distribution."""
    folders = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
    return file.suffix != ".py" or any(file.is_relative_to(folder) for folder in folders)


@cache
def _version(package: str) -> str:
    """Names and versions of the distributions of a package."""
    names = sorted(set(metadata.packages_distributions().get(package, ())))
    return " ".join(f"{name} {metadata.version(name)}" for name in names)


@cache
def _imports(text: bytes, package: str) -> tuple[str, ...]:
    """Names of modules that a file imports, and of objects in them."""
    nodes: list[ast.AST] = [ast.parse(text)]
    names: list[str] = []
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            nodes += node.orelse
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: len(package.split(".")) - node.level + 1]
            base = ".".join([*(parents if node.level else []), *filter(None, [node.module])])
            names += [base, *(f"{base}.{alias.name}" for alias in node.names)]
        else:
            nodes += ast.iter_child_nodes(node)
    return tuple(names)
