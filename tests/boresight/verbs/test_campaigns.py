"""`explore`, `accuracy`, `montecarlo` and `experiment`, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

EXPERIMENT = """
from boresight import Experiment, Result, Target


class Mine(Experiment):
    \"\"\"One of mine.\"\"\"

    def run(self, *, seed, runs, say):
        high = Target(name="error", source="data sheet", value=0.1 * runs, high=0.25, unit="m")
        return Result(figures={"seed": float(seed)}, targets=(high,))
"""


def test_explore(here: Path, data, refused) -> None:
    line = "explore mine.py mine.csv --word 18,28,32 --config small -o out --synth"
    found = data(f"{line} --want pos<1mm --least lut")
    assert [row["word"] for row in found["rows"]] == [18, 28, 32]
    assert found["choice"]["row"].startswith("28 bits")
    assert Path("out/explore-mine.html").exists()
    assert "wanted" in refused("explore mine.py mine.csv --want nosuch<1 -o out")


def test_accuracy(here: Path, data, refused) -> None:
    found = data("accuracy mine.py mine.csv -o out")
    fixed = next(e for e in found["estimators"] if e["level"] == "fixed")
    error = data("run mine.py mine.csv")["truth"]
    assert fixed["mean"] == {d["output"]: d["rms"] for d in error}
    assert json.loads(Path("out/accuracy.json").read_text())["estimators"]
    assert "wanted attitudes" in refused("accuracy mine.py")


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
    assert "FAIL  error (data sheet): 0.3 m, wanted at most 0.25" in text
    assert text.splitlines()[-1] == "FAILED: error"
    assert "nosuch" in refused("experiment nosuch")
