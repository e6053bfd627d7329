"""Cores as `compile` writes them, each made once: one program for Spartan-6; two for any part."""

from pathlib import Path
from typing import Any

import pytest

from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.levels import rtl
from boresight.sim.levels.build import Build
from boresight.verbs.compile import core_texts, write_core
from tests.support.track import Track


class Half(Estimator):
    """Without parameters, states and a time step."""

    inputs = (Input("u", -4.0, 4.0, "m"),)
    outputs = (Output("half", "m"), Output("turn", "turn"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        return {}, {"half": 0.5 * u.u, "turn": 0.125 * u.u}


def _written(folder: Path, build: Build, target: str) -> tuple[Path, Build]:
    """24 records of each program, to be quick."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rtl, "_RECORDS", (24, 24))
        texts = core_texts(build, rtl.recorded(build), target)
    write_core(folder, build.core, texts)
    return folder, build


@pytest.fixture(scope="session")
def one(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Build]:
    """One program of 32-bit words, for the part: its folder and what it is made from."""
    return _written(tmp_path_factory.mktemp("one"), Build(Track()), "xc6slx9")


@pytest.fixture(scope="session")
def several(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Build]:
    """Two programs of 18-bit words, without primitives."""
    build = Build(Track(), Half(), word=18)
    return _written(tmp_path_factory.mktemp("several"), build, "generic")
