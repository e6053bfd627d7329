"""`montecarlo` and `experiment` from the command line; saturations in every verb."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path

import pytest

EXPERIMENT = """
from boresight import Experiment, ExperimentResult, Target


class Mine(Experiment):
    \"\"\"One of mine.\"\"\"

    def run(self, *, seed, runs, say):
        high = Target(name="error", source="data sheet", value=0.1 * runs, high=0.25, unit="m")
        return ExperimentResult(figures={"seed": float(seed)}, targets=(high,))
"""


RAMP = """
from boresight import Estimator, Input, Output, State, World


class Ramp(Estimator):
    inputs = (Input("z", 0.0, 10.0, "m"),)
    states = (State("sum", -15.0, 15.0, "m"),)
    outputs = (Output("double", "m", tolerance=1e-3),)

    def step(self, x, u, p):
        total = x.sum + u.z
        return {"sum": total}, {"double": 2.0 * u.z}


class Rising(World):
    def draw(self, seed):
        self.slope = 1.0 + seed

    def start(self):
        self.k = 0

    def record(self, outputs):
        self.k += 1
        return {"z": self.slope, "double_true": 0.0} if self.k <= 6 else None
"""


def test_every_verb_names_what_saturates(here: Path, data, said) -> None:
    """A state of [-15, 15], with 4 m more in each of six updates, is clamped in three of them."""
    Path("ramp.py").write_text(RAMP)
    Path("ramp.csv").write_text("z,double_true\n" + 6 * "4,0\n")
    wanted = "3 updates SATURATED: state sum"
    for level in ("fixed", "c", "rtl"):
        assert wanted in said(f"run ramp.py ramp.csv --levels {level} -o out.csv")
    assert data("run ramp.py ramp.csv --levels float")["saturated"] == {}
    os.mkfifo("pipe")  # which is read once: no names
    writer = threading.Thread(
        target=Path("pipe").write_bytes, args=(Path("ramp.csv").read_bytes(),)
    )
    writer.start()
    assert "3 updates SATURATED\n" in said("run ramp.py pipe -o out.csv")
    writer.join()
    world = "ramp.py:Rising --seed 3 -o out.csv"
    assert wanted in said(f"run ramp.py:Ramp {world}", 1)
    assert wanted in said("check ramp.py:Ramp ramp.csv --levels c", 1)
    assert wanted in said("accuracy ramp.py:Ramp ramp.csv")
    (row,) = data("explore ramp.py:Ramp ramp.csv --word 32 --config small --jobs 1 -o out", 1)[
        "rows"
    ]
    assert wanted in row["reason"]
    # Slopes of 2, 3 and 4 m: none, one and three updates.
    text = said("montecarlo ramp.py:Rising ramp.py:Ramp --runs 3 -o out", 1)
    assert text.endswith("FAILED: 4 updates SATURATED: state sum (4) in 2 of 3 draws\n")
    assert "judged against truth: no output" in text


@pytest.mark.parametrize(("limit", "code"), [(6.2, 1), (6.3, 0)])
def test_montecarlo_judges_the_truth(limit: float, code: int, here: Path, said) -> None:
    """Errors of 4, 6 and 8 m."""
    text = RAMP.replace("tolerance=1e-3", f"truth={limit}").replace("15.0", "99.0")
    Path("ramp.py").write_text(text)
    text = said("montecarlo ramp.py:Rising ramp.py:Ramp --runs 3 -o out", code)
    assert ("FAILED: double rms 6.22 m over all draws: BEYOND 6.2\n" in text) == bool(code)
    assert "judged against truth: double\n" in text


def test_montecarlo(here: Path, data, said, refused) -> None:
    found = data("montecarlo mine.py mine.py --runs 4 --steps 60 -o out")
    assert {*found["outputs"]} == {"pos", "vel"} and found["runs"] == 4
    command = found["worst"]["command"].removeprefix("boresight ")
    assert said(f"{command} -q").startswith("mineworld and mine on c: 60 records")
    assert "levels: wanted one of" in refused("montecarlo mine.py mine.py --levels rtl")


def test_experiment(here: Path, data, said, refused) -> None:
    Path("lab.py").write_text(EXPERIMENT)
    found = data("experiment lab.py --runs 2 --seed 5 -o out")
    assert found["good"] and found["figures"] == {"seed": 5.0}
    assert found["targets"][0]["pass"] and json.loads(Path("out/mine.json").read_text())["good"]
    text = said("experiment lab.py --runs 3 -o out", 1)
    (row,) = (line.split("  ") for line in text.splitlines() if line.startswith("error"))
    assert [*filter(None, map(str.strip, row))] == [
        "error", "data sheet", "0.3 m", "at most 0.25", "FAIL",
    ]  # fmt: skip
    assert text.splitlines()[-1] == "FAILED: error"
    assert "nosuch" in refused("experiment nosuch")
