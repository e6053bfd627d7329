"""Runs of the registration: one of them with all it gives, and what its bound predicts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.radar.bound import covariances, deviations, information
from boresight.systems.radar.estimator import Registration
from boresight.systems.radar.interface import AXES, BIASES
from boresight.systems.radar.world import NOISE, TwoRadars

UNITS = np.array([1.0, math.pi / 180.0, math.pi / 180.0] * 2)  #: m and rad of m and deg.


def first(range_m: float, angle_deg: float) -> dict[str, float]:
    """Parameters of a P0 [m, deg]."""
    wanted = [range_m, angle_deg, angle_deg] * 2
    return {f"p0_{b}": w / n for b, w, n in zip(BIASES, wanted, NOISE, strict=True)}


@dataclass(frozen=True, eq=False)
class Watched:
    """A run: errors of the biases (n, 6) in shares of the bias; tracks less target (n, 2, 3) [m].

    ``before`` as reported, ``after`` as the filter gives them; NaN where a radar missed.
    ``saturated``: updates with a word beyond its range; ``deviation``: largest share by which fixed
    point differs from float64 at the last record.
    """

    t: FloatArray
    error: FloatArray
    before: FloatArray
    after: FloatArray
    saturated: int
    deviation: float


def watch(world: TwoRadars, params: Mapping[str, float]) -> Watched:
    """Run a world on the integer C, and on float64."""
    build = Build(Registration(), params=[params])
    loop = close_loop(world, make_level("c", build))
    reference = make_level("float", build).run(loop.inputs)
    names = [f"{b}_bias" for b in BIASES]
    biases = np.stack([loop.outputs[n] for n in names], axis=1)
    declared = [o for o in build.estimators[0].outputs if o.name in names]
    errors = [d.apart[-1] for d in differences(declared, loop.outputs, reference.outputs)]
    corrected = np.stack(
        [[loop.outputs[f"{a}{i}_corrected"] for a in AXES] for i in "12"]
    ).transpose(2, 0, 1)
    return Watched(
        np.arange(len(biases)) * np.float64(world.dt),
        (biases - world.bias) / world.bias,
        world.reported.transpose(1, 0, 2) - world.place[:, None],
        corrected - world.place[:, None],
        loop.run.n_saturated,
        float((errors / np.abs(world.bias)).max()),
    )


@dataclass(frozen=True, eq=False)
class Predicted:
    """Theory after each record (n, 6), in the biases' units.

    ``free``: bound without a prior; ``bayes``: with the prior, over biases drawn from it; ``sd``,
    ``mean``: spread and mean error of the best linear filter at biases that are given, of which a
    prior around zero takes its share; ``equal``: bound where both radars' biases are one (n, 3);
    ``weak``: least observed direction at the last record, in units of the noise; ``condition``
    of the information there.
    """

    free: FloatArray
    bayes: FloatArray
    sd: FloatArray
    mean: FloatArray
    equal: FloatArray
    weak: FloatArray
    condition: float


def predicted(world: TwoRadars, range_m: float, angle_deg: float) -> Predicted:
    """Theory of a world and a prior."""
    noise, jacobians = np.array(NOISE) * UNITS, world.jacobians()
    prior = np.array([range_m, angle_deg, angle_deg] * 2) * UNITS
    fisher = information(jacobians, noise)
    p = covariances(jacobians, noise, prior)
    both = np.concatenate([np.eye(3), np.eye(3)])
    unit = noise[:3]
    term = (both.T @ fisher @ both) * np.outer(unit, unit)
    values, vectors = np.linalg.eigh(fisher[-1] * np.outer(noise, noise))
    free = covariances(jacobians, noise, np.full(6, np.inf))
    return Predicted(
        deviations(free),
        deviations(p),
        deviations(p @ fisher @ p),
        -np.einsum("nij,j->ni", p, world.bias / prior**2),
        deviations(np.linalg.pinv(term, hermitian=True)) * unit,
        vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0]),
        float(values[-1] / values[0]),
    )
