"""The wheel, the source archive, and the versions they are made with."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import boresight
from boresight.sim.records.bundled import bundled
from tests.support.tree import ROOT

# -- what users install: complete, the same from a clone and a source archive, below one name -----

ROOMS = ("model", "gateware", "firmware", "sim", "systems")


def contents(wheel: Path) -> dict[str, bytes]:
    """The package's files by name, without the metadata's."""
    with zipfile.ZipFile(wheel) as archive:
        return {
            info.filename: archive.read(info)
            for info in archive.infolist()
            if ".dist-info/" not in info.filename
        }


def in_tree(tree: Path) -> dict[str, bytes]:
    """What has to be in the wheel: every file of the product folders."""
    results = {f"boresight/{p.name}": p for p in (tree / "boresight").iterdir() if p.is_file()}
    folders = [p for p in (tree / "boresight").iterdir() if p.is_dir() and not p.is_symlink()]
    for folder, name in [*((f, f"boresight/{f.name}") for f in folders)] + [
        (tree / room, f"boresight/{room}") for room in ROOMS
    ]:
        for path in folder.rglob("*"):
            if path.is_file():
                results[f"{name}/{path.relative_to(folder)}"] = path
    return {name: path.read_bytes() for name, path in results.items()}


def test_holds_the_tree_and_nothing_else(wheel: Path, tree: Path) -> None:
    inside, wanted = contents(wheel), in_tree(tree)
    assert sorted(inside) == sorted(wanted)
    assert inside == wanted
    assert "boresight/py.typed" in inside
    assert {"sv", "csv", "html", "c", "h", "S", "ld"} <= {n.rpartition(".")[2] for n in inside}


def test_metadata(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = {n.partition(".dist-info/")[2]: n for n in archive.namelist() if ".dist-info/" in n}
        assert archive.read(names["top_level.txt"]).split() == [b"boresight"]
        metadata = archive.read(names["METADATA"]).decode()
    assert "\nLicense-Expression: BSD-2-Clause\n" in metadata
    assert f"\nVersion: {boresight.__version__}\n" in metadata
    assert "\nDescription-Content-Type: text/markdown\n" in metadata
    assert "\nSummary: " in metadata and "\nKeywords: fpga," in metadata
    assert "\nClassifier: Typing :: Typed\n" in metadata
    assert (
        "licenses/LICENSE" in names and "licenses/sim/data/LICENSE.scikit-kinematics.txt" in names
    )


def test_citation_is_of_this_version(tree: Path) -> None:
    lines = (tree / "CITATION.cff").read_text().splitlines()
    assert f"version: {boresight.__version__}" in lines and "license: BSD-2-Clause" in lines


def test_the_source_archive_is_the_repository(sdist: Path) -> None:
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {"Makefile", "constraints.txt", "CHANGELOG.md", "CITATION.cff", "LICENSE"}
    assert (
        wanted | {"docs/learn/first.md", "docs/images/overview.svg", "tests/conftest.py"} <= names
    )
    assert not [name for name in names if name.endswith(".pyc")]


def test_of_a_source_archive_is_the_same(wheel: Path, wheel_of_sdist: Path) -> None:
    assert contents(wheel_of_sdist) == contents(wheel)


def test_editable_is_a_plain_path(tree: Path, tmp_path: Path) -> None:
    """Type checkers and editors follow a path; of an import hook they know nothing."""
    code = "import sys; from setuptools.build_meta import build_editable as b; b(sys.argv[1])"
    subprocess.run(
        [sys.executable, "-c", code, tmp_path], cwd=tree, check=True, capture_output=True
    )
    (made,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(made) as archive:
        (path,) = (archive.read(n).decode() for n in archive.namelist() if ".dist-info/" not in n)
    assert [p.name for p in Path(path.strip()).iterdir() if p.suffix != ".egg-info"] == [
        "boresight"
    ]


def test_list(installed) -> None:
    text = installed.run(installed.program, "list")
    assert text == installed.run(installed.python, "-m", "boresight", "list")
    assert "complementary" in text and "mekf" in text
    assert (
        "registration" in text
        and "experiments: array, battery, ekf2, ins_gnss, ma2014, mls, pmsm, radar, satcom" in text
    )


def test_new(installed) -> None:
    installed.run(installed.program, "new", "mine")
    assert "class Mine(Estimator)" in (installed.folder / "mine.py").read_text()


def test_compile(installed) -> None:
    installed.run(
        installed.python, "-m", "boresight", "compile", "complementary", "-q", "-o", "out"
    )
    report = json.loads((installed.folder / "out" / "report.json").read_text())
    assert report["design"] == "complementary"
    assert "module core" in next((installed.folder / "out").glob("**/core.v")).read_text()


def test_check_at_all_levels(installed) -> None:
    said = installed.run(
        *(installed.program, "check", "complementary", bundled("ximu_walk"), "--json"),
        *("--steps", "20", "--simulator", "verilator"),
    )
    (result,) = json.loads(said)["results"]
    assert result["good"]
    assert {x["level"]: x["n_mismatch"] for x in result["verification"]} == dict.fromkeys(
        ("fixed", "c", "rtl"), 0
    )


def test_a_users_script_beside_its_own_model(installed, users_script) -> None:
    said = installed.run(installed.python, users_script(installed.folder))
    owner, good, place = said.strip().split(" ", 2)
    assert (owner, good) == ("user", "True")
    assert Path(place).is_relative_to(installed.python.parents[1])


# -- the versions of `constraints.txt` are those of every dependency, and come from anywhere ------

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
