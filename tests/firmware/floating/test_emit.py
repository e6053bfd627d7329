"""The float C: strict compilers accept it, and it is as a person would write it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.floating.emit import emit_float_c
from boresight.model.estimators import estimator
from tests.support.estimators import ALL

STRICT = (
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Werror",
)


@pytest.mark.parametrize("name", sorted(ALL))
def test_no_warning(name: str, tmp_path: Path) -> None:
    for file, text in emit_float_c(ALL[name]()).items():
        (tmp_path / file).write_text(text)
    subprocess.run(
        ["gcc", *STRICT, "-O2", "-c", f"{name}_float.c", "-o", "x.o"], cwd=tmp_path, check=True
    )


@pytest.mark.parametrize("name", sorted(ALL))
def test_single_precision_only(name: str) -> None:
    source = emit_float_c(ALL[name]())[f"{name}_float.c"]
    code = re.sub(r"//.*|/\*[\s\S]*?\*/", "", source)
    assert "double" not in code
    assert not re.search(r"(?<![\w.])\d+\.\d+(?!\d*f|\d*e)", code)
    assert not re.search(r"\b(sin|cos|sqrt|atan2|asin|fabs|floor)\(", code)
    assert max(map(len, source.splitlines())) <= 100


def test_interface_is_that_of_the_integer_c() -> None:
    from boresight.firmware.emit import emit_c

    e = estimator("mekf")
    integer = emit_c(e.compile())["mekf.h"]
    single = emit_float_c(e)["mekf_float.h"]

    def members(text: str, kind: str) -> list[str]:
        body = re.search(rf"(?s)typedef struct {{([^}}]*)}} mekf(?:_float)?{kind}_t;", text)
        assert body
        return re.findall(r"(?:int32_t|float) (\w+);", body[1])

    for kind in ("_params", "_state", "_in", "_out"):
        assert members(single, kind) == members(integer, kind)
    for function in ("init", "reset", "update"):
        assert f"void mekf_float_{function}(" in single


def test_same_estimator_same_text() -> None:
    assert emit_float_c(estimator("ekf_bias")) == emit_float_c(estimator("ekf_bias"))
