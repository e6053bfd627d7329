"""The wheel: complete, and of use in an environment and a folder with awkward names."""

from __future__ import annotations

import json
import os
import shutil
import site
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from boresight.sim.records.files import bundled
from tests.support.tree import ROOT

ROOMS = ("model", "gateware", "firmware", "sim", "systems")
#: Blanks, letters beyond ASCII, and what a shell would read.
ODD = "my fpga übung & (more)"
_NOT_THE_TREE = shutil.ignore_patterns(
    *(".git", ".venv*", ".*_cache", ".hypothesis", "build", "dist", "*.egg-info", "__pycache__")
)
_ENVIRONMENT = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy of the checkout."""
    tree = tmp_path_factory.mktemp("tree") / ODD
    shutil.copytree(ROOT, tree, symlinks=True, ignore=_NOT_THE_TREE)
    command = [sys.executable, "-m", "build", "--no-isolation", "--wheel", str(tree)]
    subprocess.run(command, check=True, capture_output=True)
    (result,) = (tree / "dist").glob("*.whl")
    return result


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with the wheel alone; other packages are those of the tests."""
    folder = tmp_path_factory.mktemp("installed") / ODD
    venv.create(folder, with_pip=False, symlinks=True)
    result = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(result), "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--no-index", str(wheel)], check=True, env=_ENVIRONMENT)
    ours = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
    # A folder named in a .pth file brings its packages, not its own .pth files (editable installs).
    (ours / "others.pth").write_text("".join(f"{name}\n" for name in site.getsitepackages()))
    return result


@pytest.fixture
def user(tmp_path: Path) -> Path:
    """A folder whose modules are named as ours are."""
    for name in ("ops", "output", "errors", "cli", "verbs", "sim", "gateware", "firmware"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError(__file__)\n")
    (tmp_path / "model.py").write_text('OWNER = "user"\n')
    return tmp_path


def run(folder: Path, *command: str | Path) -> str:
    """Standard output of a command that must not fail."""
    done = subprocess.run(command, cwd=folder, env=_ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


def test_holds_every_file_of_the_package(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
    tracked = subprocess.run(
        ["git", "ls-files", "boresight", *ROOMS], cwd=ROOT, capture_output=True, text=True
    ).stdout.split("\n")
    if not tracked[0]:
        pytest.skip("not a clone")
    wanted = {name if name.startswith("boresight/") else f"boresight/{name}" for name in tracked}
    links = {"boresight/", *(f"boresight/{room}" for room in ROOMS)}
    assert inside == {n for n in wanted - links if (ROOT / n).exists()}


def test_checks_a_filter_on_a_log(python: Path, user: Path) -> None:
    words = ("check", "complementary", bundled("ximu_walk"), "--json", "--steps", "20")
    said = run(user, python.parent / "boresight", *words, "--simulator", "verilator")
    (result,) = json.loads(said)["results"]
    levels = {x["level"]: x["n_mismatch"] for x in result["verification"]}
    assert result["good"] and levels == dict.fromkeys(("fixed", "c", "rtl"), 0)


def test_compiles_a_filter(python: Path, user: Path) -> None:
    run(user, python, "-m", "boresight", "compile", "complementary", "-q", "-o", "out")
    assert "module core" in (user / "out" / "core.v").read_text()


def test_serves_a_script_beside_a_module_named_model(python: Path, user: Path) -> None:
    (user / "script.py").write_text(
        "import boresight, model\nprint(model.OWNER, boresight.__file__, boresight.Estimator)\n"
    )
    owner, place, *_ = run(user, python, user / "script.py").split(" /", 1)
    assert owner == "user" and Path(f"/{place}").is_relative_to(python.parents[1])
