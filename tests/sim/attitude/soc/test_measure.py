"""Measurements on the simulated soft core, and their command line."""

import json
from pathlib import Path

import numpy as np
import pytest

from boresight.firmware.attitude import image
from boresight.firmware.floating.text import operation_counts
from boresight.model.attitude import FILTERS, estimator
from boresight.sim.attitude.soc.__main__ import main, table
from boresight.sim.attitude.soc.comparison import PAPER_CYCLES, compare_one
from boresight.sim.attitude.soc.measure import measure_float, measure_integer
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from tests.support.attitude.soc.operations import counted_cycles, operation_cycles

# -- integer C on the simulated soft core equals the model bit for bit; float C its reference -----

#: Updates: every program runs the same instructions in each but for its data.
UPDATES = 8


@pytest.mark.parametrize(
    "name",
    [
        # The smallest and the largest in code; all of them in `make firmware`, too.
        pytest.param(n, marks=[] if n in ("complementary", "mekf") else [pytest.mark.soak])
        for n in FILTERS
    ],
)
def test_comparison(name: str) -> None:
    row = compare_one(name, read_record(bundled("ximu_walk")), updates=UPDATES, restarts=1)
    integer, single = row["integer"], row["float"]
    assert integer["updates"] == single["updates"] == UPDATES
    assert integer["mismatches"] == 0
    assert single["status_mismatches"] == 0
    assert single["apart_deg"] < 1e-4
    # No interrupt reaches into an update: integers take the same path but for what data asks for.
    assert integer["cycles"]["max"] < 1.05 * integer["cycles"]["min"]
    assert row["hardware"]["cycles"] * 10 < integer["cycles"]["min"] < single["cycles"]["min"]
    for way in (integer, single):
        assert 0 < way["overhead_cycles"] < 1500
        assert 100 < way["stack_bytes"] < 1024
        assert way["code_bytes"] > 10_000
    if name in PAPER_CYCLES:
        assert 0.5 < row["ratios"]["float_to_paper"] < 2.0


def test_ways_of_compiling_change_nothing_but_the_cycles() -> None:
    program = estimator("complementary").compile()
    inputs = feed(estimator("complementary"), read_record(bundled("ximu_walk"))).inputs[:5]
    small, fast = (measure_integer(program, inputs, optimise=o) for o in ("-Os", "-O2"))
    assert (small.outputs == fast.outputs).all()
    assert small.code < fast.code


def test_what_no_sensor_says() -> None:
    """Float C goes on, with what its reference gives: what is no number stays none."""
    e = estimator("complementary")
    inputs = feed(e, read_record(bundled("ximu_walk"))).inputs[:8].copy()
    inputs[2, 1:] = np.inf
    inputs[3] = 0.0
    run = measure_float(e, inputs)
    outputs = run.outputs.view(np.float32)
    assert len(outputs) == 8
    assert np.isfinite(outputs[:2]).all()
    assert np.isnan(outputs[2, 3])


def test_a_wrong_bit_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison finds one bit in one update, in either way."""
    from boresight.sim.attitude.soc import comparison

    def flipped(way: str, place: tuple[int, int], bit: int) -> None:
        measured = getattr(comparison, way)

        def wrong(*arguments, **options):
            run = measured(*arguments, **options)
            run.outputs[place] ^= np.uint32(1 << bit)
            return run

        monkeypatch.setattr(comparison, way, wrong)

    flipped("measure_integer", (3, 6), 0)
    flipped("measure_float", (2, 3), 24)
    row = compare_one("complementary", read_record(bundled("ximu_walk")), updates=5, restarts=1)
    assert row["integer"]["mismatches"] == 1
    assert row["float"]["apart_deg"] > row["float"]["bound_deg"]


# -- costs of operations on the soft core, and what they explain of an update ---------------------


def test_costs_explain_an_update() -> None:
    costs = operation_cycles()
    assert 20 < costs["less"] < costs["mul"] < costs["div"] < costs["sin"] < 10_000
    assert costs["add"] == pytest.approx(costs["sub"], rel=0.5)
    e = estimator("ekf_quaternion")
    run = measure_float(e, feed(e, read_record(bundled("ximu_walk"))).inputs[:6])
    counted = counted_cycles(operation_counts(e.trace()), costs)
    assert 0.4 < counted / run.cycles.max() < 1.0


def test_counting() -> None:
    costs = {"add": 10.0, "less": 3.0, "sin": 100.0}
    assert (
        counted_cycles(
            {
                "add": 2,
                "sin": 1,
                "clip": 1,
                "wrap": 1,
                "larger": 1,
                "less": 1,
                "select": 9,
                "neg": 4,
                "both": 2,
            },
            {**costs, "mul": 5.0},
        )
        == 20 + (100 + 5) + 6 + 6 + 3 + 3
    )


# -- the command line of the measurements ---------------------------------------------------------

ROW = {
    "estimator": "mekf",
    "paper_cycles": None,
    "hardware": {"cycles": 344},
    "ratios": {"integer_to_hardware": 81.6, "float_to_hardware": 280.3},
    "float": {
        "cycles": {"median": 96425},
        "code_bytes": 22144,
        "status_mismatches": 0,
        "apart_deg": 1e-4,
        "bound_deg": 0.02,
    },
    "integer": {"cycles": {"median": 28071}, "code_bytes": 39628, "mismatches": 0},
}


@pytest.mark.without_compiler
def test_table_says_what_differs() -> None:
    assert table([ROW]).splitlines()[1].split() == [
        "mekf",
        "96425",
        "-",
        "28071",
        "344",
        "82",
        "280",
        "22144",
        "39628",
        "yes",
    ]
    for way, key, value in (
        ("float", "apart_deg", 0.03),
        ("float", "apart_deg", float("nan")),
        ("float", "status_mismatches", 1),
        ("integer", "mismatches", 1),
    ):
        row = {**ROW, way: {**ROW[way], key: value}}
        assert table([row]).endswith(" NO")


def test_one_estimator(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--estimator", "complementary", "--updates", "3", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("complementary ")
    (row,) = json.loads((tmp_path / "report.json").read_text())["software"]
    assert row["float"]["updates"] == 3


@pytest.mark.without_compiler
def test_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--updates", "1"]) == 2
    assert capsys.readouterr().err == "error: --updates: wanted 2 or more, found 1; ask for more\n"


@pytest.mark.without_compiler
def test_no_compiler(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(image.shutil, "which", lambda name: None)
    assert main(["--estimator", "mekf", "--updates", "2"]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("error: riscv64-unknown-elf-gcc was not found: run 'make firmware'")
