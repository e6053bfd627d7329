"""Cores as `compile` writes them, each made once: one small estimator; two that are linked."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from boresight.core_files import core_texts, write_core
from boresight.sim.levels import vectors
from boresight.sim.levels.build import Build
from tests.support.linked import Inner, Middle
from tests.support.track import Track


def _written(folder: Path, build: Build, target: str) -> tuple[Path, Build]:
    """24 records of each program, to be quick."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vectors, "_RECORDS", (24, 24))
        texts = core_texts(build, vectors.recorded(build), target=target, axi=True)
    write_core(folder, build.core, texts)
    return folder, build


@pytest.fixture(scope="session")
def one(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Build]:
    """One program of 32-bit words, for the part: its folder and what it is made from."""
    build = Build(Track())
    return _written(tmp_path_factory.mktemp("one"), build, "xc6slx9")


@pytest.fixture(scope="session")
def linked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Build]:
    """Two programs of 18-bit words, the first reads what the second keeps; generic."""
    build = Build(Middle(), Inner(), word=18)
    return _written(tmp_path_factory.mktemp("linked"), build, "generic")


@pytest.fixture
def bench(tmp_path: Path) -> Callable[..., tuple[int, str]]:
    """Run a bench of a folder in one language mode; exit code and what it says.

    ``core`` and ``axi`` are other texts of the core and of what is around it, ``words`` another
    folder of its words; with ``again`` the last one is not built anew, and told that.
    """
    built = tmp_path / "bench"

    def run(
        folder: Path,
        name: str = "tb",
        *,
        mode: str = "2005",
        core: str | None = None,
        axi: str | None = None,
        words: Path | None = None,
        again: str = "",
    ) -> tuple[int, str]:
        own = folder / ("core_sim.v" if (folder / "core_sim.v").exists() else "core.v")
        sources = [folder / "tb" / f"{name}.v"]
        for path, text in ((own, core), (folder / "core_axi.v", axi)):
            sources.append(tmp_path / path.name)
            sources[-1].write_text(path.read_text() if text is None else text)
        if not again:
            command = ["iverilog", f"-g{mode}", "-s", name, "-o", built, *sources]
            subprocess.run(command, check=True)
        done = subprocess.run(
            ["vvp", "-n", built, *([again] if again else [])],
            cwd=words or folder / "tb",
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout + done.stderr

    return run
