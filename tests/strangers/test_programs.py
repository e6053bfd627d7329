"""Programs as strangers write them, on every level, through the front door."""

from __future__ import annotations

import ast

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.model.resolve import estimator_of
from tests.support.strangers import PROGRAMS, STRANGERS, csv
from tests.support.strangers import program as place

NAMES = list(STRANGERS)
#: Each kind of operation once: for the RTL at every change.
FEW = [
    *("kalman.py", "madgwick.py:Madgwick", "biquad.py", "pendulum.py"),
    *("alphabeta.py", "geometry.py:Look", "battery.py"),
]


@pytest.mark.parametrize("file", PROGRAMS.values(), ids=PROGRAMS)
def test_a_file_needs_nothing_but_the_front_door(file) -> None:
    allowed = {"Estimator", "Input", "Output", "Param", "State", "World", "blocks", "ops"}
    allowed.add("kalman")
    filters = {"Attitude", "Kalman", "Measurement", "State", "vector"}
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            assert {a.name for a in node.names} <= {"math", "numpy"}
        if isinstance(node, ast.ImportFrom):
            known = {"boresight": allowed, "boresight.kalman": filters}[node.module]
            assert {a.name for a in node.names} <= known


@pytest.mark.parametrize("name", NAMES)
def test_numpy_and_compiled_float_agree(name: str) -> None:
    columns, _ = STRANGERS[name](100)
    program = place(name)
    written, compiled = (boresight.run(program, columns, levels=on) for on in ("numpy", "float"))
    for output, values in written["outputs"].items():
        assert np.allclose(values, compiled["outputs"][output], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_check_is_good(name: str) -> None:
    steps = 2000 if name.startswith("fir") else 1000  # it is slow
    levels = ("fixed", "c", "rtl") if name in FEW else ("fixed", "c")
    columns, _ = STRANGERS[name](steps)
    (result,) = boresight.check(place(name), columns, levels=levels)["results"]
    assert result.good, [*(x.line() for x in result.levels), *result.accuracy.lines()]
    assert [x.n_total for x in result.levels] == [steps] * len(levels)
    assert all(d.tolerance is not None for d in result.accuracy.differences)
    for output in estimator_of(place(name)).outputs:
        words = np.unique(result.fixed.outputs[output.name])
        assert len(words) > (1 if output.unit == "flags" else 50)


@pytest.mark.parametrize("name", NAMES)
def test_a_log_in_other_units_is_the_same_record(name: str, tmp_path) -> None:
    inputs = STRANGERS[name](100)
    program = place(name)
    log = csv(tmp_path / "log.csv", inputs)
    assert "[" in log.read_text().splitlines()[0]
    plain, read = (boresight.run(program, x, levels="numpy") for x in (inputs[0], log))
    for output, values in plain["outputs"].items():
        assert np.allclose(values, read["outputs"][output], rtol=1e-7, atol=1e-7)


def test_the_controller_holds_its_motor_on_the_rtl(tmp_path, capsys) -> None:
    world, filter = place("pi.py:Motor(steps=600)"), place("pi.py:Pi")
    log = tmp_path / "loop.csv"
    assert main(["run", filter, world, "--levels", "rtl,fixed", "-o", str(log)]) == 0
    assert "bit by bit" in capsys.readouterr().out
    seen = boresight.run(filter, log, levels="c")  # the loop's record is a log
    target, speed = np.loadtxt(log, delimiter=",", skiprows=1, unpack=True)
    assert len(seen["outputs"]["drive"]) == 600
    assert np.abs(target - speed)[350:400].max() < 0.02 * 150.0
