"""The comparison of soft core and engine, and its page."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.attitude.complementary import Complementary
from boresight.model.estimator import input_words
from boresight.sim.attitude.board.setup import SCALED
from boresight.sim.attitude.soc import comparison
from boresight.sim.attitude.soc import offload as module
from boresight.sim.attitude.soc.comparison import PAPER_CYCLES, compare, compare_one
from boresight.sim.attitude.soc.measure import Measured
from boresight.sim.attitude.soc.offload import offload
from boresight.sim.attitude.soc.page import bars, render_page, timeline
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.record import Record

# -- figures of the comparison, on measurements that are played; test_main.py takes real ones -----

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
        source = inputs.astype(np.float32).astype(float)
        out = e.run_float(source[..., None]).outputs
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


# -- the judgement of an offload, on a board that is played; test_system.py runs the real one -----

OFFLOAD_N = 6


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Update 3 of six has not been seen in memory; the first two wait for the firmware."""
    program = Complementary().compile()
    inputs = np.random.default_rng(1).integers(
        -(2**20), 2**20, (OFFLOAD_N - 1, len(program.inputs))
    )
    outputs, _ = CModel(program).update(inputs)
    updates = 1_000 * np.arange(1, OFFLOAD_N + 1)
    seen = np.delete(np.arange(OFFLOAD_N), 3)
    newest = SimpleNamespace(
        inputs=inputs,
        outputs=outputs.copy(),
        header=(seen + 1) | 5 << 16,
        complete=updates[seen] + [9_000, 8_000, 160, 180, 200],
    )
    run = SimpleNamespace(
        newest=newest,
        updates=updates,
        samples=np.append(updates - [300, 310, 320, 310, 300, 305], 7_000),
        cycles=8_000,
        seconds=1.234,
    )
    monkeypatch.setattr(
        module, "attitude_image", lambda system, ram: SimpleNamespace(code_size=7, data_size=ram)
    )
    monkeypatch.setattr(module, "stimulus", lambda log, board: ("stimulus", log, board.setup))
    asked: list[Any] = []
    core = SimpleNamespace(parts=[SimpleNamespace(program=program)])
    return SimpleNamespace(
        board=SimpleNamespace(system="system", core=core, setup=SCALED),
        ram=64,
        run=lambda image, what, updates: asked.append((what, updates)) or run,
        asked=asked,
        newest=newest,
    )


def test_figures(bench: Any) -> None:
    log: Any = "log"
    data = offload(bench, log, updates=OFFLOAD_N)
    assert bench.asked == [(("stimulus", "log", SCALED), OFFLOAD_N)]
    assert (data["estimator"], data["updates"], data["in_memory"]) == (
        "complementary",
        OFFLOAD_N,
        OFFLOAD_N - 1,
    )
    assert data["mismatches"] == 0
    assert data["sample_to_update_cycles"] == {"min": 300, "max": 320}
    assert data["update_to_memory_cycles"] == {"median": 180, "max": 200}
    assert (data["code_bytes"], data["data_bytes"], data["simulation_seconds"]) == (7, 64, 1.23)
    assert data["setup"]["clock_hz"] == SCALED.clock_hz


def test_every_wrong_update_counts_once(bench: Any) -> None:
    bench.newest.outputs[1, :2] ^= 1
    bench.newest.outputs[4, -1] ^= 1
    log: Any = "log"
    assert offload(bench, log)["mismatches"] == 2


# -- the page of the comparison: every figure of the report is on it ------------------------------


def row(name: str, scale: int, paper: int | None) -> dict:
    """A row as `sim.attitude.soc.comparison.compare_one` makes it."""

    def software(cycles: int, **more) -> dict:
        return {
            "cycles": {"median": cycles},
            "updates": 1000,
            "code_bytes": 20_000 + cycles,
            **more,
        }

    return {
        "estimator": name,
        "log": "a <log>",
        "paper_cycles": paper,
        "float": software(60_000 * scale, apart_deg=1.3e-4),
        "integer": software(14_000 * scale, mismatches=0),
        "hardware": {"cycles": 250 * scale},
        "ratios": {"integer_to_hardware": 56.0, "float_to_hardware": 240.0},
    }


ROWS = [row("complementary", 1, 31_600), row("mekf", 2, None)]
OFFLOAD = {
    "estimator": "mekf",
    "updates": 1000,
    "in_memory": 998,
    "mismatches": 3,
    "sample_to_update_cycles": {"max": 653},
    "update_to_memory_cycles": {"median": 180, "max": 192},
}


def test_page() -> None:
    page = render_page({"software": ROWS, "offload": OFFLOAD})
    for text in (
        "60,000",
        "14,000",
        "250",
        "31,600",
        "120,000",
        "0 of 1,000",
        "1.3e-04",
        "998 of 1,000",
        "3 differ",
        "653",
        "180",
        "192",
        "a &lt;log&gt;",
    ):
        assert text in page, text
    assert "{{" not in page and "{rows}" not in page
    assert page.count("<svg") == 2 and "http" not in page


def test_without_offload() -> None:
    assert "Offload" not in render_page({"software": ROWS})


def test_plots_show_the_figures() -> None:
    assert "28,000" in bars(ROWS) and "316 µs in the paper" in timeline(ROWS)
    assert bars(ROWS) == bars(ROWS)
