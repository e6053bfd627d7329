"""A program named like a standard header gets files of another name, which compile."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import boresight
from boresight import Estimator, Input, Output


class Stdint(Estimator):
    """An input, passed on."""

    inputs = (Input("time", -1.0, 1.0),)
    outputs = (Output("y"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"y": u.time}


def test_no_file_takes_the_place_of_a_header(tmp_path: Path) -> None:
    boresight.compile(Stdint, output=tmp_path / "core")
    folder = tmp_path / "core" / "firmware"
    assert not (folder / "stdint.h").exists()
    flags = ["-std=c99", "-fsyntax-only", f"-I{folder}"]
    subprocess.run(["gcc", *flags, folder / "stdint_.c"], check=True)
