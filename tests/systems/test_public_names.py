"""A system imports its own folder, and what the documentation offers to users: nothing else."""

import re
from importlib import import_module
from pathlib import Path

import pytest

import boresight
from tests.support.tree import ROOT, imports, python_files

SYSTEMS = sorted(p.parent.name for p in (ROOT / "systems").glob("*/estimator.py"))
_DIRECTIVE = re.compile(r"^\.\. auto(module|class|function|data|exception):: ([\w.]+)$", re.M)


def documented() -> set[str]:
    """Full names that a page of `docs/reference/` documents, and modules that it documents."""
    names = {"boresight", *(f"boresight.{name}" for name in boresight.__all__)}
    for page in (ROOT / "docs" / "reference").glob("*.md"):
        for kind, name in _DIRECTIVE.findall(page.read_text(encoding="utf-8")):
            names.add(name)
            if kind == "module":
                module = import_module(name)
                own = getattr(module, "__all__", [n for n in vars(module) if n[0] != "_"])
                names |= {f"{name}.{n}" for n in own}
    return names


def hidden(path: Path, system: str, names: set[str]) -> set[str]:
    """What a file of a system imports of Boresight that is neither documented nor its own."""
    ours = {name for name in imports(path) if name.partition(".")[0] == "boresight"}
    return {n for n in ours - names if not n.startswith(f"boresight.systems.{system}.")}


@pytest.mark.parametrize("system", SYSTEMS)
def test_imports(system: str) -> None:
    names = documented()
    results = {
        path.relative_to(ROOT).as_posix(): hidden(path, system, names)
        for path in python_files(f"systems/{system}")
    }
    assert not {place: names for place, names in results.items() if names}


@pytest.mark.parametrize(
    ("line", "seen"),
    [
        ("from boresight import Estimator", False),
        ("from boresight.model.algebra.quaternion import dot", False),
        ("from boresight.model.algebra import quaternion", False),
        ("from boresight.systems.mine.world import Plant", False),
        ("from boresight.systems.other.world import Plant", True),
        ("from boresight.gateware.core import build_core", True),
        ("def later():\n    import boresight.sim.levels.rtl", True),
        ("from boresight.sim.experiments.seeds import POOLED", True),
    ],
)
def test_what_counts(line: str, seen: bool, tmp_path: Path) -> None:
    path = tmp_path / "module.py"
    path.write_text(line)
    assert bool(hidden(path, "mine", documented())) is seen


def test_every_system_is_offered_as_those_of_packages_are() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for group in ("estimators", "experiments", "worlds"):
        (part,) = re.findall(
            rf'^\[project\.entry-points\."boresight\.{group}"\]\n(.*?)^\[', text, re.M | re.S
        )
        assert set(re.findall(r'"boresight\.systems\.(\w+)\.', part)) == set(SYSTEMS), group
