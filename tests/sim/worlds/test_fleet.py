"""Many loops at once: each is the loop of one, and records are taken as a log's are."""

import dataclasses

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.fleet import Fleet, Single, close_loops
from boresight.sim.worlds.loop import close_loop


class Follow(Estimator):
    """A position that follows what is measured, where it is."""

    inputs = (
        Input("dt", 0.0, 0.1, "s", clamp=True),
        Input("z", -4.0, 4.0, "m", missing=0.0),
        Input("aim", -4.0, 4.0, "m", missing="hold"),
        Input("valid", 0.0, 1.0, "", valid_of=("z",)),
    )
    params = (Param("gain", 0.5, 0.0, 1.0, "", "share of the innovation taken"),)
    states = (State("pos", -8.0, 8.0, "m"),)
    outputs = (Output("pos", "m"), Output("late", "m"), Output("phase", "turn"))

    def step(self, x, u, p):
        pos = x.pos + p.gain * u.valid * (u.z - x.pos) + u.dt * (u.aim - x.pos)
        return {"pos": pos}, {"pos": pos, "late": x.pos, "phase": ops.wrap_turns(0.3 * pos)}


class Pursuit(Fleet):
    """Places that run away from what follows them; every third is not seen."""

    name = "pursuit"

    def __init__(self, seeds, steps=40, **spoilt):
        self.seeds, self.runs, self.steps, self.spoilt = seeds, len(seeds), steps, spoilt

    def start(self):
        self.k, self.at = 0, np.array(self.seeds) / 10.0

    def record(self, outputs):
        if self.k == self.steps:
            return None
        self.k += 1
        pos = 0.0 if outputs is None else outputs["pos"]
        self.at = np.clip(self.at + 0.1 * np.sign(self.at - pos), -3.9, 3.9)
        z = np.where((self.k + np.array(self.seeds)) % 3 == 0, np.nan, self.at)
        aim = self.at if self.k % 2 else np.full(self.runs, np.nan)
        return {"dt": np.full(1, 0.05 * self.k), "z": z, "aim": aim, **self.spoilt}


def test_each_is_a_loop_of_its_own() -> None:
    loops = close_loops(Pursuit((1, -2, 5)), Follow(), {"gain": 0.25})
    for k, seed in enumerate((1, -2, 5)):
        level = make_level("c", Build(Follow(), params=[{"gain": 0.25}]))
        one = close_loop(Single(Pursuit((seed,))), Follow(), level)
        assert (one.inputs == loops.inputs[:, k]).all() and len(one.inputs) == 40
        for name in ("pos", "late", "phase"):
            assert (one.outputs[name] == loops.outputs[name][:, k]).all()
    assert (loops.inputs[2:, 0, 0] == 0.1).all()  # clamped, as declared
    assert not loops.saturated.any()
    assert (loops.outputs["phase"] > 0.5).any() and (loops.outputs["phase"] >= 0.0).all()
    again = close_loops(Pursuit((1, -2, 5)), Follow(), {"gain": 0.25}, keep=("late",))
    assert list(again.outputs) == ["late"]
    assert (again.outputs["late"] == loops.outputs["late"]).all()


class Narrow(Follow):
    """A sum that passes its word."""

    states = (State("pos", -1.0, 1.0, "m"),)
    outputs = Follow.outputs[:2]

    def step(self, x, u, p):
        pos = ops.bounded(x.pos + u.z, -1.0, 0.999, "wrongly")
        return {"pos": pos}, {"pos": pos, "late": x.pos}


def test_saturations_are_counted_by_run() -> None:
    loops = close_loops(Pursuit((39, 0)), Narrow())
    level = make_level("fixed", Build(Narrow()))
    alone = [int(level.run_anew(loops.inputs[:, k]).saturated.sum()) for k in range(2)]
    assert loops.saturated.tolist() == alone == [40, 0]


@pytest.mark.parametrize(
    "spoilt, message",
    [
        ({"z": np.array([0.0, 4.5])}, "input z: wanted -4 to 4 m, found 4.5"),
        ({"dt": np.full(1, np.nan)}, "input dt: wanted 0 to 0.1 s, found nan"),
        ({"aim": np.full(2, np.nan)}, "input aim: wanted -4 to 4 m, found nan"),
        ({"z": np.array([0.0, np.inf])}, "input z: wanted -4 to 4 m, found inf"),
    ],
)
def test_records_are_checked(spoilt: dict, message: str) -> None:
    with pytest.raises(InputError, match=f"^fleet pursuit, {message}"):
        close_loops(Pursuit((1, 2), **spoilt), Follow())


def test_what_is_missing_altogether() -> None:
    class Without(Pursuit):
        def record(self, outputs):
            found = super().record(outputs)
            return found and {n: v for n, v in found.items() if n != "aim"}

    with pytest.raises(InputError, match=r"^fleet pursuit, input aim: .* found none"):
        close_loops(Without((1,)), Follow())
    with pytest.raises(InputError, match=r"^fleet pursuit: wanted at least one record, found none"):
        close_loops(Pursuit((1,), steps=0), Follow())


def test_loops_are_not_changed_from_outside() -> None:
    loops = close_loops(Pursuit((1,)), Follow())
    with pytest.raises(dataclasses.FrozenInstanceError):
        loops.inputs = loops.inputs
