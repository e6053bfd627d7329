"""The versions of `constraints.txt` are those of every dependency, and come from anywhere."""

from __future__ import annotations

import re
import tomllib

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.support.tree import ROOT

LOCK = (ROOT / "constraints.txt").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def locked() -> dict[str, list[Requirement]]:
    """Lines of the lock by name."""
    lines: dict[str, list[Requirement]] = {}
    for line in LOCK.splitlines():
        if not line.startswith("#"):
            requirement = Requirement(line)
            lines.setdefault(canonicalize_name(requirement.name), []).append(requirement)
    return lines


def test_every_dependency_is_in_it_with_a_version_that_is_allowed() -> None:
    lines = locked()
    extras = PROJECT["optional-dependencies"].values()
    for text in [*PROJECT["dependencies"], *(line for extra in extras for line in extra)]:
        wanted = Requirement(text)
        if wanted.name == PROJECT["name"]:
            assert wanted.extras <= PROJECT["optional-dependencies"].keys()
            continue
        for line in lines[canonicalize_name(wanted.name)]:
            (exact,) = line.specifier
            assert exact.operator == "==" and exact.version in wanted.specifier, text


def test_one_version_for_every_python() -> None:
    several = {name for name, lines in locked().items() if len(lines) > 1}
    assert not several


def test_every_python_that_is_declared_is_tested() -> None:
    workflow = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8"))
    start = "Programming Language :: Python :: 3."
    declared = [c.removeprefix(start[:-2]) for c in PROJECT["classifiers"] if c.startswith(start)]
    assert workflow["jobs"]["test"]["strategy"]["matrix"]["python"] == declared
    assert PROJECT["requires-python"] == f">={declared[0]}"


def test_it_names_no_place() -> None:
    assert not re.search(r"://|^\s*-|@", LOCK, re.MULTILINE)


def test_linters_are_exact() -> None:
    tests = {
        r.name: str(r.specifier) for r in map(Requirement, PROJECT["optional-dependencies"]["test"])
    }
    assert all(tests[name].startswith("==") for name in ("ruff", "mypy"))
