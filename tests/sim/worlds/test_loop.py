"""Closed loops: what goes round, where two part, and worlds that are at fault."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.records.feed import feed
from boresight.sim.records.files import content_of
from boresight.sim.worlds.loop import Loop, close_loop, drive, parting
from boresight.sim.worlds.world import World
from tests.support.records import parsed

NAN = float("nan")


class Half(Estimator):
    """A controller that can be followed by hand; ``new`` tells whether z is."""

    inputs = (
        Input("z", -8.0, 8.0, "m", missing="hold"),
        Input("new", 0.0, 1.0, "", valid_of="z"),
        Input("c", -1.0, 1.0, "", missing=0.0, clamp=True),
    )
    states = (State("n", 0.0, 64.0, "", 0.0),)
    outputs = (Output("u", "m"), Output("n", ""), Output("c", ""))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        n = x.n + u.new
        return {"n": n}, {"u": -0.5 * u.z, "n": n, "c": u.c + 0.0}


class Plant(World):
    """Moves by what it is told; every third sample is missing."""

    def __init__(self, length: int = 6) -> None:
        self.length = length

    def start(self) -> None:
        self.z, self.k = 4.0, 0
        self.heard: list[Any] = []

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        self.heard.append(outputs)
        if self.k == self.length:
            return None
        if outputs is not None:
            self.z += outputs["u"]
        self.k += 1
        truth = {"u_true": float(self.k)} if self.k % 2 else {}
        return {"z": NAN if self.k % 3 == 0 else self.z, "c": 2.0 * self.k - 4.0, **truth}


def closed(world: World, level: str = "numpy", **options: Any) -> Loop:
    return close_loop(world, make_level(level, Build(Half())), **options)


def test_by_hand() -> None:
    plant = Plant()
    result = closed(plant)
    # z: 4, 4-2, (2-1), held: 1-1 = 0, ...
    assert result.inputs.tolist() == [
        [4.0, 1.0, -1.0],
        [2.0, 1.0, 0.0],
        [2.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, 0.0, 1.0],
    ]
    assert result.outputs["u"].tolist() == [-2.0, -1.0, -1.0, 0.0, 0.0, 0.0]
    assert result.outputs["n"].tolist() == [1.0, 2.0, 2.0, 3.0, 4.0, 4.0]
    assert result.new[:, 0].tolist() == [True, True, False, True, True, False]
    assert result.truth["u"][::2].tolist() == [1.0, 3.0, 5.0]
    assert np.isnan(result.truth["u"][1::2]).all() and list(result.truth) == ["u"]
    assert result.clamped == {"c": 5}
    assert result.run.words is None and result.run.saturated is None
    assert result.level == "numpy"
    assert plant.heard[0] is None
    assert plant.heard[1:] == [
        {n: v[k] for n, v in result.outputs.items()} for k in range(len(result.inputs))
    ]


def test_what_it_saw_is_a_log() -> None:
    """Run again on any level it gives the same outputs: gaps and flags are kept."""
    for level in ("numpy", "fixed"):
        result = closed(Plant(), level)
        again = parsed("loop.csv", content_of("loop.csv", result.record(Half(), "loop")))
        assert list(again.columns) == ["z", "c", "u_true"]
        feed_columns = feed(Half(), again)
        assert np.array_equal(feed_columns.inputs, result.inputs)
        assert np.array_equal(feed_columns.truth["u"], result.truth["u"], equal_nan=True)
        replayed = make_level(level, Build(Half())).run(feed_columns.inputs).outputs
        for name, values in result.outputs.items():
            assert np.array_equal(replayed[name], values)
    assert result.record(Half(), "loop").place(2, "z") == "loop, z[2]"


def test_columns_without_a_use_are_a_note_of_the_log() -> None:
    class Logged(Plant):
        def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
            columns = super().record(outputs)
            return None if columns is None else {**columns, "restart": 1.0}

    result = closed(Logged()).record(Half(), "plant")
    assert result.notes == ("not used: restart of plant, neither inputs nor OUTPUT_true of half",)


def test_a_loop_starts_both_anew() -> None:
    plant, level = Plant(), make_level("numpy", Build(Half()))
    first = close_loop(plant, level)
    second = close_loop(plant, level)
    assert np.array_equal(first.inputs, second.inputs)
    assert parting(first, second) is None


def test_steps_and_progress() -> None:
    assert len(closed(Plant(), steps=2).inputs) == 2
    assert len(closed(Plant(), steps=99).inputs) == 6
    heard: list[int] = []
    closed(Plant(2500), progress=heard.append, steps=2100)
    assert heard == [1000, 2000]


class Odd(Plant):
    """At fault in its third record."""

    def __init__(self, third: Any) -> None:
        super().__init__()
        self.third = third

    def record(self, outputs: Mapping[str, float] | None) -> Any:
        source = super().record(outputs)
        if self.k == 3:
            return self.third(outputs, source)
        return source


@pytest.mark.parametrize(
    "third, message",
    [
        (lambda o, r: 5, "world odd, step 2: wanted a record: values by input name, or None at the "
         "end, found int; return a dictionary"),
        (lambda o, r: {**r, "c": np.inf}, "world odd, step 2, c: wanted a finite number, found an"),
        (lambda o, r: {"z": 1.0}, "world odd, step 2, c: wanted a value for every input of half, "
         "found none; "),
        (lambda o, r: {**r, "z": 9.0}, "world odd, step 2, z: wanted -8 to 8 m, the "
         "declared range, found 9; correct the record that the world returns"),
        (lambda o, r: {**r, "u_true": "much"}, "world odd, step 2, u_true: wanted a number, found "
         "str; "),
        (lambda o, r: {**r, "u_true": np.inf}, "world odd, step 2, u_true: wanted a finite number"),
    ],
)  # fmt: skip
def test_records_that_are_refused(third: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        closed(Odd(third))


def test_worlds_that_raise() -> None:
    with pytest.raises(
        InputError,
        match=r"^world odd, step 2, test_loop\.py, line \d+: wanted a record: .*KeyError: 'v'; ",
    ):
        closed(Odd(lambda o, r: o["v"]))

    class Unready(Plant):
        def start(self) -> None:
            raise RuntimeError("no data\nat all")

    with pytest.raises(InputError, match=r"^world unready, .*found RuntimeError: no data; "):
        closed(Unready())

    class Refusing(Plant):
        def start(self) -> None:
            raise InputError("mine")

    with pytest.raises(InputError, match="^mine$"):
        closed(Refusing())


def test_worlds_without_records() -> None:
    with pytest.raises(
        InputError,
        match=r"^world plant: wanted at least one record, found none; let record\(\) return None "
        r"only at the end$",
    ):
        closed(Plant(0))
    with pytest.raises(InputError, match=r"^world world: wanted a method record\(self, outputs\)"):
        closed(World())


def test_integer_levels_never_part_and_floats_do() -> None:
    class Third(Half):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            state, out = super().step(x, u, p)
            return state, {**out, "u": -u.z / 3.0}

    loops = {
        n: close_loop(Plant(40), make_level(n, Build(Third()))) for n in ("fixed", "c", "float")
    }
    assert parting(loops["fixed"], loops["c"]) is None
    near = parting(loops["c"], loops["float"])
    assert near is not None and near.startswith("c and float part in step 0: output u, -1.333")
    assert near.endswith(f" and {-4.0 / 3.0!r}")


class Follow(Estimator):
    """A position that follows what is measured; its sum passes its word beyond 1."""

    inputs = (
        Input("dt", 0.0, 0.1, "s", clamp=True),
        Input("z", -4.0, 4.0, "m", missing=0.0),
        Input("valid", 0.0, 1.0, "", valid_of=("z",)),
    )
    params = (Param("gain", 0.5, 0.0, 1.0, "", "share of the innovation taken"),)
    states = (State("pos", -8.0, 8.0, "m"), State("sum", -1.0, 1.0, "m"))
    outputs = (Output("pos", "m"), Output("late", "m"), Output("phase", "turn"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        pos = x.pos + p.gain * u.valid * (u.z - x.pos) + u.dt
        total = ops.bounded(x.sum + 0.03 * u.z, -1.0, 0.999, "wrongly")
        phase = ops.wrap_turns(0.3 * pos)
        return {"pos": pos, "sum": total}, {"pos": pos, "late": x.pos, "phase": phase}


class Pursuit(World):
    """Positions that move away from the estimated ones; every third sample is missing."""

    def __init__(self, seeds: tuple[int, ...], steps: int = 40, **wrong: Any) -> None:
        self.seeds, self.runs, self.steps, self.wrong = seeds, len(seeds), steps, wrong

    def start(self) -> None:
        self.k, self.at = 0, np.array(self.seeds) / 10.0

    def record(self, outputs: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
        if self.k == self.steps:
            return None
        self.k += 1
        pos = 0.0 if outputs is None else outputs["pos"]
        self.at = np.clip(self.at + 0.1 * np.sign(self.at - pos), -3.9, 3.9)
        z = np.where((self.k + np.array(self.seeds)) % 3 == 0, np.nan, self.at)
        true = {"late_true": self.at, "pos_true": 0.5}
        return {"dt": np.full(1, 0.05 * self.k), "z": z, **true, **self.wrong}


def pursued(seeds: tuple[int, ...], level: str = "c", runs: int | None = 3, **more: Any) -> Loop:
    keep = more.pop("keep", None)
    build = Build(Follow(), params=[{"gain": 0.25}])
    return close_loop(Pursuit(seeds, **more), make_level(level, build, runs=runs), keep=keep)


def test_each_run_of_a_batched_plant_is_a_loop_of_its_own() -> None:
    loops = pursued((1, -2, 39))
    for k, seed in enumerate((1, -2, 39)):
        alone = pursued((seed,), runs=None)
        assert (alone.inputs == loops.inputs[:, k]).all() and len(alone.inputs) == 40
        assert (alone.new == loops.new[:, k]).all()
        for name in ("pos", "late", "phase"):
            assert (alone.outputs[name] == loops.outputs[name][:, k]).all()
        for name in ("late", "pos"):
            assert (alone.truth[name] == loops.truth[name][:, k]).all()
        assert (alone.run.words == loops.run.words[:, k]).all()
        assert (alone.run.saturated == loops.run.saturated[:, k]).all()
    assert (loops.inputs[2:, 0, 0] == 0.1).all() and loops.clamped == {"dt": 38 * 3}
    assert (loops.outputs["phase"] > 0.5).any() and (loops.outputs["phase"] >= 0.0).all()
    some = pursued((1, -2, 39), keep=("late",))
    assert list(some.outputs) == ["late"] == list(some.truth) and some.run.words is None
    assert (some.outputs["late"] == loops.outputs["late"]).all()
    assert (some.run.saturated == loops.run.saturated).all()


def test_a_loop_knows_flags_and_states() -> None:
    """They are those of the level on the records that it saw."""
    for name in ("c", "fixed"):
        loop = pursued((39,), name, None)
        again = make_level(name, Build(Follow(), params=[{"gain": 0.25}])).run(loop.inputs)
        assert 0 < loop.run.saturated.sum() < 40
        assert (loop.run.saturated == again.saturated).all()
        assert (loop.run.words == again.words).all() and (loop.run.states == again.states).all()


def test_records_of_batched_plants_are_checked() -> None:
    with pytest.raises(InputError, match=r"^world pursuit, step 0, run 1, z: wanted -4 to 4 m, .*"):
        pursued((1, 2, 3), z=np.array([0.0, 4.5, 0.0]))
    with pytest.raises(InputError, match="^world pursuit: wanted as many runs as the level has, 3, "
                       "found 2; make the level with runs=world.runs"):  # fmt: skip
        pursued((1, 2))
    with pytest.raises(InputError, match="^world pursuit: wanted as many runs as the level has, 1"):
        pursued((1, 2), runs=None)


class Recorded(World):
    """Records without feedback, in pieces that end at some borders."""

    def __init__(self, *borders: int, runs: int | None = None) -> None:
        self.borders, self.runs = borders, runs

    def pieces(self) -> Any:
        k = np.arange(60.0)
        z = np.where(k % 3 == 2, NAN, 4.0 * np.sin(k))
        z = z if self.runs is None else z[:, None] * np.linspace(-1.0, 1.0, self.runs)
        columns = {"z": z, "c": 0.1 * k - 2.0, "u_true": k}
        for piece in np.split(np.arange(60), self.borders):
            yield {name: values[piece] for name, values in columns.items()}


@pytest.mark.parametrize("level", ["numpy", "fixed", "c", "rtl"])
def test_pieces_are_one_run(level: str) -> None:
    """Held samples, states and clamps go on from piece to piece, on every level."""
    whole = closed(Recorded(), level)
    with make_level(level, Build(Half())) as made:
        assert [len(part.inputs) for part in drive(Recorded(1, 6, 51), made)] == [1, 5, 45, 9]
        assert len(close_loop(Recorded(1, 6, 51), made, steps=20).inputs) == 20
        result = close_loop(Recorded(1, 6, 51), made)
    assert parting(whole, result) is None and len(result.inputs) == 60
    assert (result.new == whole.new).all() and result.clamped == whole.clamped == {"c": 39}
    assert result.truth["u"].tolist() == [*range(60)]
    again = make_level(level, Build(Half())).run(result.inputs)
    for name, values in again.outputs.items():
        assert (result.outputs[name] == values).all()
    if again.words is not None:
        assert (result.run.words == again.words).all()


def test_a_log_is_one_part() -> None:
    """From a reset on, with what the log says of it."""
    seen = closed(Recorded(), "c")
    feed_columns = feed(Half(), seen.record(Half(), "log"))
    level = make_level("c", Build(Half()))
    for _ in range(2):
        (result,) = drive(feed_columns, level)
        assert parting(seen, result) is None and (result.new == seen.new).all()
        assert (result.run.words == seen.run.words).all()
        assert (result.truth["u"] == seen.truth["u"]).all() and result.clamped == {}


def test_pieces_of_a_batched_plant() -> None:
    loop = close_loop(Recorded(7, runs=2), make_level("c", Build(Half()), runs=2), keep=("u",))
    whole = closed(Recorded(), "c")
    assert (loop.inputs[:, 1] == whole.inputs).all() and (loop.truth["u"][:, 0] == range(60)).all()
    assert (loop.outputs["u"][:, 1] == whole.outputs["u"]).all() and list(loop.outputs) == ["u"]


@pytest.mark.parametrize(
    "second, reason",
    [
        (
            {"z": np.zeros(3), "c": np.zeros(2)},
            "4: wanted columns of one length, found lengths 2 and 3",
        ),
        ({}, "4: wanted columns of one length, found none; "),
        (
            {"z": np.zeros(0), "c": np.zeros(0)},
            "4: wanted columns of one length, found lengths 0; ",
        ),
        ([1.0], "4: wanted a record: values by input name, or None at the end, found list; "),
        ({"z": np.array([0.0, 9.0]), "c": np.zeros(2)}, "5, z: wanted -8 to 8 m"),
    ],
)
def test_pieces_that_are_refused(second: Any, reason: str) -> None:
    class Two(World):
        def pieces(self) -> Any:
            yield {"z": np.zeros(4), "c": np.zeros(4)}
            yield second

    with pytest.raises(InputError, match=f"^world two, step {reason}"):
        closed(Two())
