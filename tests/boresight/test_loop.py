"""Closed loops of the user's files: figures, verdicts, and what is refused."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boresight
from boresight import loop as module
from boresight.cli import main
from boresight.loop import LoopResult, simulate_world
from boresight.model.errors import InputError
from boresight.sim.levels.integer import Emitted
from boresight.sim.worlds.world import world_of

FILES = """
from boresight import Estimator, Input, Output, State, World, ops


class Plant(World):
    def __init__(self, length=50):
        self.length = length

    def start(self):
        self.z, self.k = 2.0, 0

    def record(self, outputs):
        if self.k == self.length:
            return None
        self.z += 0.1 * outputs["u"] if outputs else 0.0
        self.k += 1
        return {"z": self.z, "u_true": -0.7 * self.z}


class Filter(Estimator):
    inputs = (Input("z", -4.0, 4.0, "m"),)
    states = (State("sum", -64.0, 64.0, "m"),)
    outputs = (Output("u", "m", tolerance=1e-5), Output("shown", ""))

    def step(self, x, u, p):
        total = x.sum + 0.01 * u.z
        return {"sum": total}, {"u": -0.7 * u.z - 0.1 * total, "shown": total}


class Clamping(Filter):
    def step(self, x, u, p):
        state, out = super().step(x, u, p)
        return state, out | {"shown": ops.bounded(4.0 * u.z, -1.0, 1.0, "wrongly")}


class Timed(Filter):
    rates_hz = {"dt": 100.0}


class More(Plant):
    def record(self, outputs):
        record = super().record(outputs)
        return record and record | {"dt": 0.01, "w_true": 1.0, "hum": 3.0}


class Slow(Plant):
    def record(self, outputs):
        record = super().record(outputs)
        return record and record | {"dt": 0.1}


class Strict(Filter):
    outputs = (Output("u", "m", tolerance=1e-15), Output("shown", ""))
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.py").write_text(FILES)
    return tmp_path


def simulated(**options: Any) -> LoopResult:
    return simulate_world("f.py:Plant", options.pop("estimator", "f.py:Filter"), **options)


def test_figures() -> None:
    heard: list[str] = []
    data = simulated(on="fixed", against="c", output="loop.csv", progress=heard.append)
    assert data.good and data.parting is None and data.clamped == {}
    assert (data.world, data.estimator) == ("plant", "filter")
    assert (data.on, data.against, data.records) == ("fixed", "c", 50)
    assert data.records_per_s > 0
    assert heard == ["plant and filter on fixed", "plant and filter on c"]
    near, shown = data.accuracy
    assert (near.output, near.tolerance, near.good) == ("u", 1e-5, True)
    assert 0.0 < near.largest < 1e-7 and shown.tolerance is None
    (truth,) = data.truth
    assert truth.output == "u" and truth.tolerance is None and 0.01 < truth.largest < 0.1
    plain = data.to_json()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["records"] == 50 and plain["accuracy"][0]["max"] == near.largest


def test_the_loop_it_wrote_is_a_log() -> None:
    data = simulated(output="loop.csv")
    text = Path("loop.csv").read_text().splitlines()
    assert text[0] == "z,u_true" and text[1] == "2.0,-1.4" and len(text) == 51
    again = boresight.run("f.py:Filter", "loop.csv", on="c")
    assert again.truth[0].largest == data.truth[0].largest


def test_what_the_estimator_does_not_use_is_named() -> None:
    data = simulate_world("f.py:More", "f.py:Filter", steps=3)
    assert data.unused == ("w_true", "hum") and simulated(steps=3).unused == ()
    assert "not used of what more gives: w_true, hum: no input, or OUTPUT_true, of" in str(data)


def test_a_declared_rate_is_that_of_the_loop_and_of_its_log() -> None:
    simulate_world("f.py:More", "f.py:Timed", steps=3, output="loop.csv")
    times = boresight.record_of("loop.csv").columns["t"].values
    assert times.tolist() == [0.0, 0.01, 0.02]
    with pytest.raises(
        InputError, match="^world slow, step 0, dt: wanted 100 samples a second, .* found 10; corr"
    ):
        simulate_world("f.py:Slow", "f.py:Timed", steps=3)


@pytest.mark.parametrize("level", ["float", "numpy"])
def test_no_verdict_without_fixed_point(level: str) -> None:
    last = str(simulated(on=level, steps=3)).splitlines()[-1]
    assert last == "no fixed point was judged: choose --on fixed, c or rtl"


def test_beside_a_loop_on_float64_the_one_on_integers_is_judged() -> None:
    good = simulated(on="float", against="fixed")
    assert str(good).endswith("\ngood") and 0.0 < good.accuracy[0].largest < 1e-7
    bad = simulated(on="float", against="fixed", estimator="f.py:Clamping")
    assert not bad.good and bad.saturated_updates and "SATURATED" in str(bad)


def test_one_level_alone_and_steps() -> None:
    heard: list[str] = []
    data = simulated(on="c", against="c", steps=7, progress=heard.append)
    assert data.good and data.records == 7
    assert heard == ["plant and filter on c"]
    assert simulated(on="c", against="c", estimator="f.py:Filter").records == 50


def test_floats_part_and_that_is_good() -> None:
    data = simulated(on="c", against="float")
    assert data.good
    assert re.fullmatch(
        r"c and float part in step 0: output \w+ on the same records: these levels differ, "
        r"-1\.40\d+ and -1\.40\d+",
        data.parting,
    )
    assert simulated(on="numpy", against="c").good


def test_integer_levels_that_part_are_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = module.make_level

    class Wrong(Emitted):
        """The C with one wrong answer."""

        count, closed = 0, False

        def advance(self, records: Any) -> Any:
            self.count += 1
            run = super().advance(records)
            wrong = {**run.outputs, "u": run.outputs["u"] + 2.0**-20}
            return replace(run, outputs=wrong) if self.count == 9 else run

        def close(self) -> None:
            self.closed = True

    made: list[Wrong] = []

    def odd(name: str, build: Any) -> Any:
        if name == "c":
            made.append(Wrong(build))
            return made[-1]
        return whole(name, build)

    monkeypatch.setattr(module, "make_level", odd)
    data = simulated(on="fixed", against="c")
    assert not data.good
    assert data.parting.startswith("fixed and c part in step 8: output u on the same records")
    assert made[0].closed
    assert main(["simulate", "f.py:Plant", "f.py:Filter", "--on", "fixed", "--quiet"]) == 1


def test_beyond_the_tolerance_is_a_failure() -> None:
    data = simulated(estimator="f.py:Strict")
    assert data.parting is None and not data.good
    assert not data.accuracy[0].good
    assert not simulated(estimator="f.py:Strict", against="float").good


@pytest.mark.parametrize("level", ["c", "fixed", "rtl"])
def test_saturation_is_a_failure(level: str) -> None:
    """Of an output without a tolerance too; ``check`` of the same records fails alike."""
    steps = 20 if level == "rtl" else None
    data = simulated(estimator="f.py:Clamping", on=level, steps=steps, output="loop.csv")
    assert data.parting is None and all(d.good for d in data.accuracy) and not data.good
    assert 0 < data.saturated_updates <= data.records
    assert data.causes[0].startswith(f"{data.saturated_updates} updates SATURATED: ")
    assert data.causes[0] in str(data).splitlines() and str(data).endswith("FAILED")
    (checked,) = boresight.check("f.py:Clamping", "loop.csv", levels=["fixed"]).results
    assert checked.accuracy.causes() == data.causes
    assert simulated(estimator="f.py:Clamping", on="numpy").good


def test_levels_are_closed_when_a_world_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, closed = module.make_level, []

    def watched(name: str, *args: Any, **options: Any) -> Any:
        level = whole(name, *args, **options)
        level.close = lambda: closed.append(name)
        return level

    monkeypatch.setattr(module, "make_level", watched)

    class Broken(boresight.World):
        def record(self, outputs: Any) -> Any:
            return 1 / 0

    with pytest.raises(boresight.InputError, match="ZeroDivisionError"):
        simulate_world(Broken, "f.py:Filter")
    assert closed == ["c"]


def test_texts() -> None:
    data = simulated(on="fixed", against="c")
    lines = str(replace(data, records=12345, records_per_s=67890)).splitlines()
    assert lines[:2] == [
        "plant and filter on fixed: 12,345 records, 67,890 a second",
        "the same records and outputs as on c, bit by bit",
    ]
    assert re.fullmatch(r"u from float64 on the same records: max \S+ m, rms \S+", lines[2])
    assert re.fullmatch(r"shown from float64 on the same records: max \S+, rms \S+", lines[3])
    assert re.fullmatch(r"u from truth: max \S+ m, rms \S+", lines[4])
    assert lines[5:] == ["good"]
    beyond = str(simulated(estimator="f.py:Strict", against="float"))
    assert "BEYOND 1e-15\n" in beyond and beyond.endswith("\nFAILED")
    assert " part in step " in beyond
    alone = str(simulated(on="c", against="c"))
    assert "bit by bit" not in alone
    gap = replace(data, truth=(replace(data.truth[0], largest=math.nan, rms=math.nan),))
    assert "from truth" not in str(gap)


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "f.py:Plant(length=9)", "f.py:Filter", "--on", "c", "--quiet"]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("plant and filter on c: 9 records, ")
    assert captured.out.endswith("\ngood\n") and captured.err == ""


GAIN = """
from boresight import Estimator, Input, Output, Param


class Gain(Estimator):
    inputs = (Input("z", -4.0, 4.0, "m"),)
    params = (Param("k", -0.7, -1.0, 1.0),)
    outputs = (Output("u", "m", tolerance=1e-3),)

    def step(self, x, u, p):
        return {}, {"u": p.k * u.z}
"""


def test_words_and_parameters(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``--word``, ``--param`` and ``--params`` reach the filter in the loop."""
    (here / "g.py").write_text(GAIN)
    (here / "k.json").write_text('{"k": -0.25}')
    line = ["simulate", "f.py:Plant", "g.py", "--on", "fixed", "--json"]
    results = []
    for more in ([], ["--word", "18"], ["--param", "k=-0.25"], ["--params", "k.json"]):
        assert main([*line, *more]) == 0
        results.append(json.loads(capsys.readouterr().out))
    wide, narrow, first, other = (d["accuracy"][0]["max"] for d in results)
    assert narrow > 100 * wide > 0.0
    truths = [d["truth"][0]["max"] for d in results]
    assert truths[2] == truths[3] > 10 * truths[0] and first == other
    assert main([*line, "--param", "q=1"]) == 2
    assert main([*line, "--word", "40"]) == 2


def test_worlds_of_installed_packages(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = type(world_of("f.py:Plant"))

    def points(*, group: str) -> list[Any]:
        point = metadata.EntryPoint("moon", "package:moon", group)
        return [point] if group == "boresight.worlds" else []

    monkeypatch.setattr(metadata, "entry_points", points)
    monkeypatch.setattr(metadata.EntryPoint, "load", lambda self: made)
    assert main(["simulate", "moon", "f.py:Filter", "--on", "c", "-q"]) == 0
    assert capsys.readouterr().out.startswith("plant and filter on c: 50 records")
    assert main(["simulate", "sun", "f.py:Filter", "--on", "c", "-q"]) == 2
    assert capsys.readouterr().err.startswith("error: --on: wanted a world before it, found the ")


@pytest.mark.pythons
def test_a_constructor_that_raises_is_not_wrong_arguments(here: Path) -> None:
    (here / "w.py").write_text(
        "from boresight import World\n\n\nclass Odd(World):\n"
        "    def __init__(self, n=0):\n        self.share = 1.0 / n\n"
    )
    with pytest.raises(boresight.InputError) as raised:
        world_of("w.py:Odd")
    assert re.fullmatch(
        "w.py:Odd, w.py, line 6: wanted a constructor that returns, found "
        "ZeroDivisionError: .*; correct it, or the arguments",
        str(raised.value),
    )
    with pytest.raises(boresight.InputError, match="^w.py:Odd.m=1.: wanted arguments that Odd tak"):
        world_of("w.py:Odd(m=1)")
    assert world_of("w.py:Odd(4)").share == 0.25


@pytest.mark.parametrize(
    "options, message",
    [
        ({"on": "vhdl"}, "on: wanted one of numpy, float, fixed, c, rtl, netlist"),
        ({"against": "no"}, "against: wanted one of numpy, float, fixed, c, rtl, net"),
        ({"config": "huge"}, "config: wanted one of small, fast"),
        ({"word": 17}, "word: wanted 18 to 32 bits, found 17; "),
        ({"steps": 0}, "steps: wanted 1 or more, found 0; "),
        ({"params": {"k": 1.0}}, "parameter k: wanted one of "),
        ({"output": "f.py"}, "f.py: wanted "),
    ],
)
def test_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(boresight.InputError, match=f"^{re.escape(message)}"):
        simulated(**options)
    assert Path("f.py").read_text() == FILES


def test_worlds_by_any_name() -> None:
    made = world_of("f.py:Plant(3)")
    assert made.name == "plant" and world_of(made) is made
    assert world_of(type(made)).name == "plant"
    with pytest.raises(
        boresight.InputError, match="^world: wanted file.py:Class, or one of .*found 'moon'; "
    ):
        world_of("moon")
    with pytest.raises(boresight.InputError, match="not derived from World; "):
        world_of("f.py:Filter")
    assert np.isfinite(simulate_world(made, "f.py:Filter").records_per_s)
