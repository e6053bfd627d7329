"""Attitude filters on exact sensors: records, float64 and fixed-point runs, errors."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.model.estimator import Estimator, input_words, param_words
from boresight.model.words.interpreter import Interpreter
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotate,
)
from tests.support.compiled_float import Columns, compiled_float

GRAVITY = 9.80665  # m/s^2
#: Columns of the nine-axis record.
DT, GYR, MAG, ACC = slice(0, 1), slice(1, 4), slice(4, 7), slice(7, 10)


def degrees(*angles: Any) -> Any:
    """Quaternions of pitch, roll and heading in degrees, numbers or arrays."""
    return euler_to_quaternion(np.radians(np.stack(np.broadcast_arrays(*angles), axis=-1)))


def sphere(pitch: Any, roll: Any, heading: Any) -> Any:
    """Quaternions (runs, 4) of every combination of angles [deg]."""
    return degrees(*(a.ravel() for a in np.meshgrid(pitch, roll, heading)))


#: Attitudes all over the sphere.
GRID = sphere(
    (-90.0, -60.0, 0.0, 30.0, 89.9),
    (-180.0, -90.0, -45.0, 0.0, 135.0),
    (-180.0, -100.0, 0.0, 60.0, 179.9),
)


def records(q: Any, dt: float, field: Any) -> Any:
    """Records (steps, 10, runs) of exact sensors on attitudes (steps, runs, 4).

    ``field`` [uT] in east, north, up. The gyro of a sample is the constant rate from the attitude
    before it; that of the first is 0.
    """
    turn = quaternion_to_rotation_vector(quaternion_multiply(quaternion_conjugate(q[:-1]), q[1:]))
    turn = np.concatenate([np.zeros((1, *q.shape[1:-1], 3)), turn])
    to_body = quaternion_conjugate(q)
    step = np.full((*q.shape[:2], 1), dt)
    x = [step, turn / dt, rotate(to_body, field), rotate(to_body, [0.0, 0.0, GRAVITY])]
    return np.moveaxis(np.concatenate(x, axis=-1), 1, 2)


def at_rest(q: Any, steps: int, dt: float, field: Any) -> Any:
    """Records (steps, 10, runs) of attitudes (runs, 4) at rest."""
    return np.repeat(records(q[None], dt, field), steps, axis=0)


def run_float(estimator: Estimator, x: Any, params: Mapping[str, float] | None = None) -> Columns:
    """Float64 outputs by name, each (steps, runs)."""
    return compiled_float(estimator, x, params)[0]


def machine(
    estimator: Estimator, runs: int, params: Mapping[str, float] | None = None, word: int = 32
) -> Interpreter:
    """The integer interpreter with the words of the parameters."""
    m = Interpreter(estimator.compile(word=word), runs)
    m.params.update(param_words(m.program, estimator.param_values(params)))
    return m


def real(m: Interpreter, out: Any) -> Columns:
    """Output words (steps, n_outputs, runs) as numbers by name."""
    p = m.program
    return {
        name: p.format(n).real(out[:, k])
        for k, (name, n) in enumerate(zip(p.output_names, p.outputs, strict=True))
    }


@cache
def _model(estimator: Estimator, word: int) -> CModel:
    return CModel(estimator.compile(word=word))


def run_words(
    estimator: Estimator, words: Any, params: Mapping[str, float] | None = None, word: int = 32
) -> tuple[Columns, bool]:
    """Outputs and, as next_NAME, states of the emitted C, (steps, runs); whether any saturated.

    ``words``: of the inputs, (steps, n_inputs, runs). An estimator object is compiled once.
    """
    model, columns, any_saturated = _model(estimator, word), [], False
    p = model.program
    for n, value in param_words(p, estimator.param_values(params)).items():
        model.set_param(p.values[n].name, value)
    for k in range(words.shape[2]):
        model.reset()
        out, saturated, states = model.trajectory(words[:, :, k])
        any_saturated |= bool(saturated.any())
        columns.append(np.concatenate([out, states], axis=1))
    results = np.stack(columns, axis=2)
    names = [*p.output_names, *(f"next_{p.values[s].name}" for s, _ in p.states)]
    values = [*p.outputs, *(s for s, _ in p.states)]
    pairs = enumerate(zip(names, values, strict=True))
    return {n: p.format(v).real(results[:, k]) for k, (n, v) in pairs}, any_saturated


def run_fixed(
    estimator: Estimator, x: Any, params: Mapping[str, float] | None = None, word: int = 32
) -> Columns:
    """As `run_words`, of numbers; no value may saturate."""
    words = input_words(_model(estimator, word).program, x)
    results, saturated = run_words(estimator, words, params, word)
    assert not saturated
    return results


def apart(out: Any, q: Any) -> Any:
    """Angle [deg] between outputs (steps, runs) and attitudes (..., 4)."""
    error = quaternion_multiply(quaternion_conjugate(q), attitude_of(out))
    return np.degrees(np.linalg.norm(quaternion_to_rotation_vector(error), axis=-1))


def bits(out: Any) -> Any:
    """Status (steps, runs) as integers."""
    return np.rint(out["status"]).astype(int)
