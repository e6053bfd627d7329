"""What an identity depends on: the sources of things, with what they import, and versions."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from boresight.model.errors import InputError
from boresight.model.resolve import load
from boresight.sim import identity as module
from boresight.sim.identity import identity
from boresight.sim.worlds.world import World

PLANT = "from boresight import World\n{import_}\nclass Plant(World):\n    pass\n"
PARTS = {
    "import helper": True,
    "from helper import size": True,
    "def later():\n    import helper\n": True,
    "import unused_elsewhere": False,
    "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import helper\n": False,
}


@pytest.fixture
def plant(tmp_path: Path) -> Callable[[str], str]:
    """Identity of a world in a file beside ``helper.py``, whose text is given."""

    def of(text: str, line: str = "import helper") -> str:
        (tmp_path / "helper.py").write_text(text)
        (tmp_path / "unused_elsewhere.py").write_text("")
        (tmp_path / "plant.py").write_text(PLANT.format(import_=line))
        return identity(load(f"{tmp_path}/plant.py", World, "world", {}, ""))

    return of


@pytest.mark.parametrize("line", PARTS)
def test_what_a_users_file_imports_counts(line: str, plant: Callable[..., str]) -> None:
    first = plant("size = 1\n", line)
    assert first == plant("size = 1\n", line)
    assert (first != plant("size = 2\n", line)) == PARTS[line]


def test_the_file_itself_counts(plant: Callable[..., str]) -> None:
    assert plant("", "") != plant("", "# another")


def package(folder: Path, monkeypatch: pytest.MonkeyPatch, **files: str) -> ModuleType:
    """A package ``mine`` that was imported."""
    root = folder / "mine"
    root.mkdir(exist_ok=True)
    for name, text in {"__init__": "", **files}.items():
        (root / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder))
    for name in [n for n in sys.modules if n.partition(".")[0] == "mine"]:
        monkeypatch.delitem(sys.modules, name)
    return __import__("mine.a").a  # type: ignore[no-any-return]


def test_packages_and_relative_imports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"a": "from . import b\n", "b": "from .c import x\n", "c": "x = 1\n"}
    seen = {identity(package(tmp_path, monkeypatch, **files))}
    for changed in ({"c": "x = 2\n"}, {"b": "from .c import x as y\n"}, {"__init__": "y = 3\n"}):
        result = identity(package(tmp_path, monkeypatch, **{**files, **changed}))
        assert result not in seen
        seen.add(result)
    # Installed, its version counts in place of its text.
    monkeypatch.setattr(module.sysconfig, "get_path", lambda name: str(tmp_path))
    monkeypatch.setattr(module, "_version", lambda name: f"{name} 1.0")
    first = identity(package(tmp_path, monkeypatch, **files))
    assert first == identity(package(tmp_path, monkeypatch, **{**files, "a": "from . import c\n"}))
    monkeypatch.setattr(module, "_version", lambda name: f"{name} 1.1")
    assert first != identity(package(tmp_path, monkeypatch, **files))


def test_versions_of_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    first, alone = identity(InputError, packages=["numpy"]), identity(InputError)
    assert first != alone == identity(InputError("an object"))
    module._version.cache_clear()
    monkeypatch.setattr(module.metadata, "version", lambda name: "0.0")
    assert first != identity(InputError, packages=["numpy"])
    module._version.cache_clear()
