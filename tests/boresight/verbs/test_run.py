"""`boresight run`: on a log, in a loop, as a copy of a log."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import boresight
from boresight import Estimator, Input, Output, State
from boresight.model.errors import InputError
from boresight.sim.records.files import bundled, read_record

MINE = """
from boresight import Estimator, Input, Output, Param, State


class Hand(Estimator):
    inputs = (Input("z", -4.0, 4.0, "m", clamp=True), Input("dt", 0.0, 1.0, "s"))
    params = (Param("k", 0.5, 0.0, 1.0),)
    states = (State("x", -8.0, 8.0, "m", 1.0),)
    outputs = (Output("x", "m"), Output("h", "ht"), Output("s", "flags"))

    def step(self, x, u, p):
        y = x.x + p.k * (u.z - x.x)
        return {"x": y}, {"x": y, "h": 0.125 * u.z, "s": u.dt + u.dt}
"""
LOG = "t[ms],z[cm],x_true,h_true[deg]\n0,200,1.5,45\n500,-100,,\n1000,900,2.0,90\n"
SYNTHETIC = bundled("synthetic_60s")


@pytest.fixture
def hand(here: Path) -> None:
    Path("hand.py").write_text(MINE)
    Path("log.csv").write_text(LOG)


@pytest.mark.parametrize("level", ["float", "numpy", "fixed", "c"])
def test_by_hand(hand: None, level: str) -> None:
    result = boresight.run("hand.py", "log.csv", levels=level, output="out.csv")
    assert result["t"].tolist() == [0.0, 0.5, 1.0] and result["clamped"] == {"z": 1}
    assert np.abs(result["outputs"]["x"] - [1.5, 0.25, 2.125]).max() < 1e-8
    assert np.abs(result["outputs"]["h"] - [0.25, -0.125, 0.5]).max() < 1e-8
    assert [(d.output, d.samples) for d in result["truth"]] == [("x", 2), ("h", 2)]
    assert result["truth"][0].largest == pytest.approx(0.125, abs=1e-8)
    out = read_record("out.csv")  # what it wrote is a log itself, half turns in degrees
    units = {name: column.unit for name, column in out.columns.items()}
    assert units == {"t": "s", "x": "m", "h": "deg", "s": "flags"}
    assert np.array_equal(out.columns["h"].values, 180.0 * result["outputs"]["h"])


def test_the_command_line(hand: None, said, data) -> None:
    assert said("run hand.py log.csv --param k=0.5") == (
        "3 rows to hand-fixed.csv, RMSE against the log's truth: x 0.08839 m, h 0 ht\n"
    )
    assert Path("hand-fixed.csv").read_text().startswith("t[s],x[m],h[deg],s[flags]\n0.0,1.5,")
    assert data("run hand.py log.csv --steps 2")["outputs"]["s"] == [1.0, 1.0]
    Path("log.csv").write_text("t[ms],z[cm],x_true,mov\n0,200,1.5,1\n500,-100,,1\n1000,900,2.0,0\n")
    assert "RMSE against the log's truth: x 0 m\n" in said("run hand.py log.csv --param k=0.5")
    assert "deg: total " in said(f"run complementary {SYNTHETIC} --levels c --steps 50 -o a.csv")


@pytest.mark.parametrize(("name", "level"), [("mekf", "c"), ("complementary", "fixed")])
def test_pieces_of_any_length_give_the_same_bytes(name: str, level: str, here: Path) -> None:
    whole = boresight.run(name, SYNTHETIC, levels=level, steps=900, output="whole.csv")
    for rows in (7, 400):
        pieces = boresight.run(
            name, SYNTHETIC, levels=level, steps=900, output="out.csv", rows=rows
        )
        assert Path("out.csv").read_bytes() == Path("whole.csv").read_bytes()
        assert pieces.summary.replace("out.csv", "whole.csv") == whole.summary
        assert pieces["rows"] == 900 and not pieces["outputs"]


@pytest.mark.parametrize("level", ["float", "numpy", "fixed", "c", "rtl"])
def test_a_row_of_a_log_begins_anew(hand: None, level: str) -> None:
    log = {"dt": np.full(9, 0.5), "z": np.linspace(-3.0, 3.0, 9)}
    log["restart"] = np.isin(np.arange(9), (0, 3, 4, 8)).astype(float)
    parts = [
        boresight.run("hand.py", {n: v[a:b] for n, v in log.items()}, levels=level)["outputs"]["x"]
        for a, b in ((0, 3), (3, 4), (4, 8), (8, 9))
    ]
    whole = boresight.run("hand.py", log, levels=level)["outputs"]["x"]
    assert whole.tolist() == np.concatenate(parts).tolist() and whole[8] == 2.0
    if level in ("c", "rtl"):
        (checked,) = boresight.check("hand.py", log, levels=level)["results"]
        assert checked.good and checked.levels[0].n_total == 9
        assert checked.floating.outputs["x"][8] == 2.0
        assert checked.fixed.outputs["x"].tolist() == whole.tolist()
        program, ranges = checked.build.programs[0], checked.accuracy.ranges
        for (state, _), words in zip(program.states, checked.fixed.states.T, strict=True):
            seen = {program.values[state].initial, *words[:-1].tolist()}
            assert {ranges.low[state], ranges.high[state]} <= seen
    if level != "rtl":
        pieces = boresight.run("hand.py", log, levels=level, rows=2, output="out.csv")
        assert pieces["rows"] == 9 and read_record("out.csv").columns["x"].values[8] == 2.0


def test_data_in_memory() -> None:
    class Mine(Estimator):
        inputs = (Input("z", -4.0, 4.0, "m"),)
        outputs = (Output("y", ""), Output("t"))  # no time: nothing is written

        def step(self, x, u, p):
            return {}, {"y": u.z + 1.0, "t": u.z}

    for source in (Mine, Mine()):
        result = boresight.run(source, {"z[cm]": [100.0, -50.0]})
        assert result["outputs"]["y"].tolist() == [2.0, 0.5] and result["t"] is None
        assert result["outputs"]["t"].tolist() == [1.0, -0.5]


class Diverging(Estimator):
    """Doubles its state."""

    inputs = (Input("a", 0.0, 1.0),)
    states = (State("s", -100.0, 100.0),)
    outputs = (Output("s"),)

    def step(self, x, u, p):
        s = 2.0 * x.s + u.a
        return {"s": s}, {"s": s}


def test_an_estimator_that_diverges_is_named_with_its_step(here: Path) -> None:
    step = r"^diverging, output s, step 1023: .*diverges; --steps 1023 gives the rows before it$"
    with pytest.raises(InputError, match=step):
        boresight.run(Diverging, {"a": np.ones(1200)}, levels="numpy", output="out.csv")
    assert not Path("out.csv").exists()


def test_a_loop_on_two_levels(here: Path, data, said) -> None:
    found = data("run mine.py mine.py --levels fixed,c --steps 60 -o loop.csv")
    assert found["parting"] == {"c": None} and found["records"] == 60
    assert [o["good"] for o in found["accuracy"]] == [True, True]
    again = boresight.run("mine.py", "loop.csv", levels="c")
    assert again["truth"][0].largest == found["truth"][0]["max"]
    text = said("run mine.py mine.py --levels fixed,c --steps 60 -q")
    assert "the same records and outputs as on c, bit by bit" in text
    assert "no fixed point was judged" in said("run mine.py mine.py --levels float --steps 9 -q")
    first, other = (data(f"run mine.py mine.py --seed {k} --steps 9") for k in (1, 2))
    assert first["truth"] != other["truth"]


def test_a_loop_that_saturates_fails(here: Path, said) -> None:
    source = Path("mine.py")
    source.write_text(source.read_text().replace('"pos", -128.0, 128.0', '"pos", -8.0, 8.0'))
    assert said("run mine.py mine.py -q", 1).splitlines()[-1].startswith("FAILED: ")


def test_levels_that_part_fail(here: Path, monkeypatch, said) -> None:
    from boresight.sim.levels.registry import Emitted

    right = Emitted.advance

    def wrong(self, records):
        run = right(self, records)
        return type(run)(**{**vars(run), "outputs": {n: v + 1.0 for n, v in run.outputs.items()}})

    monkeypatch.setattr(Emitted, "advance", wrong)
    assert "fixed and c part" in said("run mine.py mine.py --levels fixed,c --steps 5 -q", 1)


def test_a_log_as_another_kind_of_file(here: Path, data, said, refused) -> None:
    assert data("run mine.csv -o copy.npz --to 1s")["rows"] < 60
    copy, log = read_record("copy.npz"), read_record("mine.csv")
    assert copy.columns["z"].values[0] == log.columns["z"].values[0]
    said("run mine.csv -o copy.log")
    assert len(read_record("copy.log")) == len(log)
    assert "wanted a suffix of logs" in refused("run mine.csv -o copy.doc")
    assert "wanted an estimator and a log" in refused("run mine.py")


REFUSED = {
    "run mine.py mine.csv --levels fast": "levels: wanted one of",
    "run mine.py mine.csv --levels c,rtl": "levels: wanted a world, found a log",
    "run mine.py mine.csv --steps 0": "steps: wanted 1 or more",
    "run mine.py mine.csv -o out.xlsx": "out.xlsx: wanted a suffix of logs",
    "run mine.py mine.csv -o out.xyz": "out.xyz: wanted a suffix of logs, .csv, ",
    "run mine.py mine.csv -o mine.csv": "mine.csv",
    "run mine.py nosuch.csv": "nosuch.csv: wanted a log file",
    "run mine.py board(speed=2)": "board: wanted one of",
    "run mine.py board(2)": "board: wanted settings by name",
    "run mine.py board --levels c": "levels: wanted a log or a world, found a board; leave it out",
    "run mine.py board --word 24": "word: wanted 32, the bits in which the simulated board",
    "run mine.py board --steps 9": "steps: wanted a log or a world, found a board",
    "run mine.py board --seed 9": "seed: wanted a world, found a board",
    "run mine.py board --param a=1": "a: wanted one of",
    "run mine.py board --every 2": "--every, --gaps, --map: wanted a log, found a board without",
    "run mine.py board(faults=True) -o x": "wanted a log, a world, or a board without faults",
    "run mine.py board(faults=True,seconds=2)": "board: wanted faults=True alone, found seconds",
    "run mine.py mine.py --every 2": "--every, --gaps, --map: wanted a log, found a world",
    "run mine.py mine.csv --seed 9": "seed: wanted a world, found a log",
    "run mine.csv --word 24 -o out.npz": "word: wanted a log or a world, found a log alone",
    "run mine.csv --profile none -o out.npz": "--profile: wanted an estimator, found a log alone",
}


@pytest.mark.parametrize("line", REFUSED)
def test_refused(line: str, here: Path, refused) -> None:
    assert REFUSED[line] in refused(line)
    json.dumps(line)
