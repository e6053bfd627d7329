"""`examples/ins_gnss.py`: in its world, and beside the textbook."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight.model.resolve import estimator_of
from boresight.sim.levels.build import Build
from tests.support.pages import ROOT

EXAMPLES = ROOT / "examples"
LOOPS = {
    "ins_gnss": (f"{EXAMPLES}/ins_gnss.py:Journey", f"{EXAMPLES}/ins_gnss.py:Ins", "small-1024")
}


def looped(name: str, folder: Path, steps: int, on: str = "c") -> dict[str, np.ndarray]:
    """Run a world; its columns, and the outputs under their names."""
    world, filter, config = LOOPS[name]
    log = folder / "log.csv"
    result = boresight.simulate_world(
        world, filter, on=on, against="c", config=config, steps=steps, output=log
    )
    assert result.good, str(result)
    truth = np.genfromtxt(log, delimiter=",", names=True)
    outputs = boresight.run(filter, log, on="c").outputs
    return {name: truth[name] for name in truth.dtype.names or ()} | outputs


def attitude_error_deg(found: dict[str, np.ndarray]) -> np.ndarray:
    q, r = (np.stack([found[f"q{c}{of}"] for c in "wxyz"]) for of in ("", "_true"))
    return np.degrees(2.0 * np.arccos(np.minimum(np.abs((q * r).sum(axis=0)), 1.0)))


def test_the_journey(tmp_path: Path) -> None:
    found = looped("ins_gnss", tmp_path, 500)
    assert np.abs(found["pn"] - found["pn_true"])[200:].max() < 2.0


@pytest.mark.soak
@pytest.mark.parametrize("on", ["fixed", "rtl"])
def test_the_journey_has_a_gap(on: str, tmp_path: Path) -> None:
    steps = 6000 if on == "fixed" else 300
    found = looped("ins_gnss", tmp_path, steps, on)
    if on == "fixed":
        assert attitude_error_deg(found)[2000:].max() < 1.0
        for c in "enu":
            assert np.abs(found[f"p{c}"] - found[f"p{c}_true"])[1000:].max() < 2.0


@pytest.mark.parametrize("name", LOOPS)
def test_float64_is_the_textbook(name: str, tmp_path: Path) -> None:
    _, text, config = LOOPS[name]
    looped(name, tmp_path, 60)
    (result,) = boresight.check(text, tmp_path / "log.csv", levels=("c",), config=config)
    assert result.good and result.textbook
    assert all(d.largest < 1e-9 for d in result.textbook), result.lines()


@pytest.mark.full_search
@pytest.mark.parametrize("name", LOOPS)
def test_the_cycles_on_the_page(name: str) -> None:
    page = (ROOT / "docs" / "learn" / "examples.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"\| `{name}\.py`, `[\w-]+` \| (\d+) \| (\d+) \|", page)
    _, text, config = LOOPS[name]
    schedule = Build(estimator_of(text), config=config).core.schedule
    assert row == (str(min(schedule.latencies)), str(schedule.interval))
