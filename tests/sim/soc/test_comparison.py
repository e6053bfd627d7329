"""Figures of the comparison, on measurements that are played; test_main.py takes real ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.estimator import input_words
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record
from boresight.sim.soc import comparison
from boresight.sim.soc.comparison import PAPER_CYCLES, compare, compare_one
from boresight.sim.soc.measure import Measured

pytestmark = pytest.mark.without_compiler
N = 40


@pytest.fixture(scope="module")
def log() -> Record:
    return read_record(bundled("synthetic_60s")).head(100)


def measured(words: Any, cycles: int) -> Measured:
    """Cycles from a number on; the first response waits for the start-up."""
    counts = cycles + np.arange(len(words))
    response = counts + np.where(np.arange(len(words)) == 0, 9_999, 50)
    return Measured(words.view(np.uint32), counts, response, stack=11, code=22, data=33, seconds=1)


@pytest.fixture
def soft(monkeypatch: pytest.MonkeyPatch) -> dict[str, Callable[[Any], Any]]:
    """The soft core's words are the models', but for what a test does to them."""
    wrong: dict[str, Callable[[Any], Any]] = {"float": lambda w: w, "integer": lambda w: w}

    def integer(program: Any, inputs: Any, *, optimise: str) -> Measured:
        words, _ = CModel(program).update(input_words(program, inputs[..., None])[..., 0])
        return measured(wrong["integer"](words.astype(np.int32)), 14_000)

    def single(e: Any, inputs: Any, *, optimise: str) -> Measured:
        given = inputs.astype(np.float32).astype(float)
        out = e.run_float(given[..., None]).outputs
        values = np.stack([out[o.name][:, 0] for o in e.outputs], axis=1).astype(np.float32)
        return measured(wrong["float"](values), 60_000)

    monkeypatch.setattr(comparison, "measure_integer", integer)
    monkeypatch.setattr(comparison, "measure_float", single)
    return wrong


def test_one_estimator(log: Record, soft: dict) -> None:
    row = compare_one("complementary", log, updates=N, restarts=1)
    assert (row["estimator"], row["log"], row["paper_cycles"]) == (
        "complementary",
        "synthetic_60s",
        PAPER_CYCLES["complementary"],
    )
    single, integer, hardware = row["float"], row["integer"], row["hardware"]["cycles"]
    assert single["updates"] == integer["updates"] == N
    assert single["cycles"] == {"min": 60_000, "median": 60_019, "max": 60_039}
    assert single["interrupt_to_result_cycles"] == {"median": 60_070, "max": 60_089}
    assert single["overhead_cycles"] == 50
    assert [integer[f"{kind}_bytes"] for kind in ("stack", "code", "data")] == [11, 22, 33]
    assert integer["mismatches"] == single["status_mismatches"] == 0
    assert single["apart_deg"] < 1e-4 < single["bound_deg"]
    assert row["ratios"] == {
        "float_to_paper": 60_019 / 31_600,
        "float_to_integer": 60_019 / 14_019,
        "integer_to_hardware": 14_019 / hardware,
        "float_to_hardware": 60_019 / hardware,
    }
    assert sum(row["operations"].values()) > 100 < hardware <= row["hardware"]["interval_cycles"]


def test_what_differs_is_told(log: Record, soft: dict) -> None:
    def integer(words: Any) -> Any:
        words[[3, 8], [0, 2]] += 1
        return words

    def single(values: Any) -> Any:
        values[5, 7] += 1.0  # status
        values[:, 3:7] = np.roll(values[:, 3:7], 1, axis=1)
        return values

    soft |= {"float": single, "integer": integer}
    row = compare_one("complementary", log, updates=N, restarts=1)
    assert row["integer"]["mismatches"] == 2
    assert row["float"]["status_mismatches"] == 1 and row["float"]["apart_deg"] > 1.0


def test_several(log: Record, monkeypatch: pytest.MonkeyPatch) -> None:
    asked, said = [], []
    monkeypatch.setattr(
        comparison, "compare_one", lambda name, log, **options: asked.append((name, options))
    )
    compare(log, names=("mekf", "ekf_bias"), updates=7, optimise="-O2", progress=said.append)
    options = {"updates": 7, "optimise": "-O2"}
    assert asked == [("mekf", options), ("ekf_bias", options)]
    assert [line.partition(":")[0] for line in said] == ["mekf", "ekf_bias"]
