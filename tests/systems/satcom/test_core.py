"""Every form of `satcom` and `satcom_pointing` gives the same words, whatever comes.

A drive with turns, blows and gaps, and records that no vehicle gives; both programs in random turns
in one core, the second on the attitude of the first; and the loop closed.
"""

from typing import Any

import numpy as np
import pytest

from boresight.firmware.many import ManyCModels
from boresight.model.estimator import Estimator, input_words, with_params
from boresight.model.words.interpreter import Interpreter
from boresight.sim.accuracy.manoeuvres import WITHIN, within
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import level_of, make_level
from boresight.sim.worlds.loop import close_loop, parting
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.pointing import SatcomPointing
from boresight.systems.satcom.world import OnTheMove

DT = 0.02
MODES = ("drive", "tumble", "blind", "restarts", *WITHIN)


def records(mode: str, steps: int, rng: np.random.Generator) -> Any:
    """Inputs (steps, 10) of `Satcom`."""
    if mode in WITHIN:
        u = within(Satcom(), mode, steps, rng)
        u[0, 0] = -DT
        return u
    u = np.zeros((steps, 10))
    u[:, 0] = DT
    u[:, 1:4] = np.cumsum(rng.normal(0.0, 0.02, (steps, 3)), axis=0).clip(-8.0, 8.0)
    u[:, 4:7] = [0.0, 0.0, -9.80665] + rng.normal(0.0, 0.05, (steps, 3))
    u[:, 7] = rng.normal(0.0, 0.06, steps).clip(-0.5, 0.5)
    u[:, 8] = rng.uniform(-1.0, 1.0, steps)
    u[:, 9] = rng.random(steps) < 0.2
    if mode == "tumble":
        u[:, 4:7] = rng.normal(0.0, 20.0, (steps, 3))
    elif mode == "blind":  # the variance of the heading comes to its limit
        u[:, 0], u[:, 9] = 0.2, 0.0
        u[:, 1:4] = rng.normal(0.0, 1e-3, (steps, 3))
    elif mode == "restarts":
        u[rng.random(steps) < 0.02, 0] = -0.1
    u[0, 0] = -DT
    return u


def places(steps: int, rng: np.random.Generator) -> Any:
    """Inputs (steps, 10) of `SatcomPointing`, the whole earth; links fill the attitude."""
    u = rng.uniform([-0.5, -1.0, -500.0], [0.5, 1.0, 20e3], (steps, 3))
    u[::17] = [0.0, 110.5 / 180.0, 0.0]  # below the satellite
    return np.concatenate([np.zeros((steps, 7)), u], axis=1)


SOAK = pytest.mark.soak


@pytest.mark.parametrize(
    "config, steps",
    [("small", 60), *(pytest.param(c, 20_000, marks=SOAK) for c in ("small", "fast"))],
)
def test_both_in_turns_in_one_core(config: str, steps: int) -> None:
    """RTL, C and interpreter: words, saturations, cycles."""
    rng = np.random.default_rng(1)
    params = [{"gyro_sd": 0.05, "bias_density": 1e-3}, None]
    build = Build(Satcom(), SatcomPointing(), config=config, params=params)
    parts = [records(m, -(-steps // len(MODES)), rng) for m in MODES]
    values = [np.concatenate(parts)[:steps], places(3 * steps // 4, rng)]
    runs = {
        name: level_of(name).run_together([make_level(name, build, k) for k in (0, 1)], values)
        for name in ("fixed", "c", "rtl")
    }
    for k, wanted in enumerate(runs["fixed"]):
        for name in ("c", "rtl"):
            assert not runs[name][k].fault
            assert (runs[name][k].words == wanted.words).all(), (name, k)
            assert (runs[name][k].saturated == wanted.saturated).all(), (name, k)
        interval = build.core.parts[k].schedule.interval
        assert (runs["rtl"][k].interval_cycles == interval).all()
    status, pointing = (np.rint(run.outputs["status"]).astype(int) for run in runs["c"])
    assert np.bitwise_or.reduce(status) & 7 == 7
    if steps > 1000:
        assert np.bitwise_or.reduce(status) == 15 and np.bitwise_or.reduce(pointing) == 3


@SOAK
@pytest.mark.parametrize("config", ["small", "fast"])
def test_ten_thousand_records_in_closed_loop(config: str) -> None:
    world, build = OnTheMove(), Build(Satcom(), config=config)
    loops = []
    for name in ("rtl", "c"):
        with make_level(name, build) as level:
            loops.append(close_loop(world, level, steps=10_000))
    assert len(loops[0].inputs) == 10_000 and parting(Satcom(), *loops) is None


def updates(estimator: Estimator, params: Any, values: Any) -> set[int]:
    """Compare interpreter and C over (steps, runs, n_inputs), extremes among them; status seen."""
    program = with_params(estimator.compile(), estimator, params)
    steps, runs, _ = values.shape
    machine, models = Interpreter(program, runs), ManyCModels(program, runs)
    limit = 2**31
    status: set[int] = set()
    form = program.format(program.outputs[-1])
    for k in range(steps):
        words = input_words(program, values[k].T)
        if k % 7 == 3:  # words beyond what any unit says
            ends = np.random.default_rng(k).integers(-limit, limit, words[:, :9].shape)
            words[:, :9] = np.where(ends % 3 == 0, np.where(ends < 0, -limit, limit - 1), ends)
        out, saturated = machine.update(words)
        result, flags = models.update(words.T.astype(np.int32))
        assert (out == result.T).all() and (saturated == flags).all(), k
        status |= {int(s) for s in form.real(np.unique(out[-1]))}
    return status


@pytest.mark.parametrize("steps, runs", [(60, 120), pytest.param(2_000, 5_000, marks=SOAK)])
@pytest.mark.parametrize("which", ["satcom", "satcom_pointing"])
def test_interpreter_is_c(which: str, steps: int, runs: int) -> None:
    """Ten million hostile updates in the long form; every status that there can be."""
    rng = np.random.default_rng(2)
    if which == "satcom":
        each = [records(m, steps * (runs // len(MODES)), rng) for m in MODES]
        values = np.concatenate([u.reshape(steps, -1, 10, order="F") for u in each], axis=1)
        params = {"gyro_sd": 0.1, "bias_density": 0.01, "heading_sd": 1.0}
        status = updates(Satcom(), params, values)
        assert {s & 7 for s in status} == {0, 1, 2, 3, 4, 5}
        assert steps < 1000 or max(status) >= 8
    else:
        values = np.stack([places(runs, rng) for _ in range(steps)])
        q = rng.normal(size=(steps, runs, 4))
        values[:, :, :4] = q / np.linalg.norm(q, axis=2, keepdims=True)
        values[:, ::17, :4] = [1.0, 0.0, 0.0, 0.0]
        values[:, :, 4:7] = rng.uniform(-8.0, 8.0, (steps, runs, 3))
        assert {0, 1, 2} <= updates(SatcomPointing(), None, values) <= {0, 1, 2, 3}
