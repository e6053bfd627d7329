"""Filters in C on the simulated soft core, and a program that uses the core through the bus."""

import shutil

import numpy as np
import pytest

from boresight.firmware.attitude.image import COMPILER, build_image, find_cross_compiler
from boresight.model.attitude import estimator
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed
from boresight.sim.attitude import soc
from boresight.sim.attitude.soc import FLOAT_BOUND_DEG, compare, measure_float
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record

needs_compiler = pytest.mark.skipif(
    shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed"
)
LOG = read_record(bundled("ximu_walk"))


@needs_compiler
@pytest.mark.parametrize("name", ["complementary", "mekf"])  # the smallest and the largest
def test_software_has_the_words_of_the_model_and_takes_longer(name: str) -> None:
    row = compare(name, LOG, updates=3)
    assert row["good"] and row["updates"] == 3 and row["mismatches"] == 0
    assert row["apart_deg"] < 1e-4
    assert row["core"] < row["bus"] < 2 * row["core"]
    assert 10 * row["bus"] < row["integer"] < row["float"]
    if row["paper"] is not None:
        assert 0.5 < row["float"] / row["paper"] < 2.0


@pytest.mark.parametrize(
    ("name", "wanted"), [("pmsm", "filters with outputs qw qx qy qz"), ("mek", "file.py:Class, or")]
)
def test_filters_that_are_refused(name: str, wanted: str, capsys) -> None:
    assert soc.main(["complementary", name]) == 2
    assert f": wanted {wanted}" in capsys.readouterr().err


@needs_compiler
def test_float_c_goes_on_after_impossible_inputs() -> None:
    e = estimator("complementary")
    inputs = feed(e, LOG).inputs[:8].copy()
    inputs[2, 1:] = np.inf
    outputs = measure_float(e, inputs).outputs.view(np.float32)
    assert len(outputs) == 8 and np.isfinite(outputs[:2]).all() and np.isnan(outputs[2, 3])


@needs_compiler
def test_wrong_bits_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def flipped(way: str, place: tuple[int, int], bit: int) -> None:
        measured = getattr(soc, way)

        def wrong(*arguments):
            run = measured(*arguments)
            run.outputs[place] ^= np.uint32(1 << bit)
            return run

        monkeypatch.setattr(soc, way, wrong)

    flipped("measure_integer", (3, 6), 0)
    flipped("measure_core", (4, 1), 31)
    flipped("measure_float", (2, 3), 24)
    row = compare("complementary", LOG, updates=5)
    assert row["mismatches"] == 2 and row["apart_deg"] > FLOAT_BOUND_DEG and not row["good"]


@needs_compiler
def test_a_full_memory_is_an_error() -> None:
    with pytest.raises(ToolFailed, match="no room for the stack|will not fit"):
        build_image({"m.c": "int main(void) { return 0; }\n"}, sources=("m.c",), ram=1024)


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(ToolMissing, match="apt-get install gcc-riscv64-unknown-elf"):
        find_cross_compiler()
