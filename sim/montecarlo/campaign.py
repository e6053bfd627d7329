"""A campaign: one estimator, one world, and the results of every draw of it."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray, IntArray
from boresight.model.declarations import PERIODS
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.methods import called
from boresight.model.resolve import Named, estimator_of
from boresight.sim.identity import identity
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import close_loop
from boresight.sim.worlds.world import NamedWorld, World, drawn, world_of

__all__ = ["Campaign", "draws"]

MOST_MARKS = 50  #: most records of a run at which its errors are stored.


@dataclass(frozen=True)
class Campaign:
    """World, estimator and level of all draws, made on first use, once in each process.

    Parameters
    ----------
    named : (world, estimator)
        As texts, classes or objects; another process can make it only from texts.
    params : tuple of (str, float)
        Values other than the defaults, sorted by name.
    on : str
        Level.
    word : int
        Word width, bits.
    steps : int, optional
        Most records of a draw.

    Raises
    ------
    InputError
        On first use: see `world_of`, `estimator_of` and `Build`.
    """

    named: tuple[NamedWorld, Named]
    params: tuple[tuple[str, float], ...] = ()
    on: str = "c"
    word: int = 32
    steps: int | None = None

    @property
    def texts(self) -> bool:
        """Whether another process can make it."""
        return all(isinstance(name, str) for name in self.named)

    @cached_property
    def world(self) -> World:
        """The world."""
        return world_of(self.named[0])

    @cached_property
    def estimator(self) -> Estimator:
        """The estimator."""
        return estimator_of(self.named[1])

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameter values."""
        return self.estimator.param_values(dict(self.params))

    @cached_property
    def level(self) -> Level:
        """The estimator in the form that is run."""
        return make_level(self.on, Build(self.estimator, word=self.word, params=[self.values]))

    @cached_property
    def identity(self) -> dict[str, Any]:
        """All that its draws depend on, as plain data, with the program and sources."""
        try:
            source = Path(inspect.getfile(type(self.world))).read_bytes()
        except (OSError, TypeError):  # defined interactively: its journal is not continued
            source = b""
        world, estimator = self.named
        return {
            "world": world if isinstance(world, str) else self.world.name,
            "world_file": hashlib.sha256(source).hexdigest(),
            "sources": identity(self.world, self.estimator, sys.modules[__name__]),
            "estimator": estimator if isinstance(estimator, str) else self.estimator.name,
            "program": self.level.program.digest,
            "params": dict(self.params),
            "level": self.on,
            "word": self.word,
            "steps": self.steps,
        }

    def __reduce__(self) -> tuple[Any, ...]:
        """Its fields, with digests of sources and program, in case these have changed since."""
        key = (self.identity["sources"], self.identity["program"])
        return _received, (key, *(getattr(self, field.name) for field in fields(self)))


@lru_cache(maxsize=2)
def _received(key: tuple[str, str], *values: Any) -> Campaign:
    """A campaign of another process: all batches of it share one."""
    return Campaign(*values)


def draws(campaign: Campaign, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Results of these draws, as plain data: see `_draw`; an error names its seed."""
    out = []
    for seed in seeds:
        try:
            out.append(_draw(campaign, seed))
        except InputError as error:
            if not error.parts:
                raise
            where = f"{error.parts['where']}, seed {seed}"
            raise InputError.at(**{**error.parts, "where": where}) from error
    return out


def _draw(campaign: Campaign, seed: int) -> dict[str, Any]:
    """Results of one draw.

    ``seed``; ``records``; ``marks``, the records at which errors are stored; ``errors``, outputs
    less truth, by name; ``nees`` and ``freedom``, squared error over the estimator's covariance;
    ``nis``, sum and number of squared normalised innovations; ``saturated`` updates.
    """
    world, estimator, level = campaign.world, campaign.estimator, campaign.level
    drawn(world, seed)
    loop = close_loop(world, level, steps=campaign.steps)
    if not loop.truth:
        raise InputError.at(
            f"world {world.name}",
            wanted=f"the truth of an output of {estimator.name}",
            found="none",
            fix="give NAME_true with the records",
        )
    run = loop.run
    n = len(loop.inputs)
    marks = np.unique(np.linspace(0, n - 1, min(n, MOST_MARKS)).round().astype(int))
    units = {o.name: o.unit for o in estimator.outputs}
    states = None
    if run.states is not None:
        pairs = zip(level.program.states, run.states.T, strict=True)
        states = {
            level.program.values[s].name: level.program.format(s).real(words)
            for (s, _), words in pairs
        }

    def errors_of(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        errors = {}
        for name in loop.truth.keys() & values.keys():
            error, period = values[name] - loop.truth[name], PERIODS.get(units[name])
            errors[name] = error if period is None else wrapped(error, period)
        return errors

    errors = errors_of(loop.outputs)
    # P is that of the states: an output of the same name may be a prediction.
    nees, freedom = _nees(campaign, states, errors | errors_of(states or {}), marks)
    nis = loop.outputs["nis"] if estimator.nis_freedom else np.zeros(0)
    positive = nis[nis > 0.0]
    return {
        "seed": seed,
        "records": n,
        "marks": marks.tolist(),
        "errors": {name: errors[name][marks].tolist() for name in loop.truth},
        "nees": nees,
        "freedom": freedom,
        "nis": [float(positive.sum()), len(positive)],
        "saturated": run.n_saturated,
    }


def _nees(
    campaign: Campaign,
    states: dict[str, FloatArray] | None,
    errors: dict[str, FloatArray],
    marks: IntArray,
) -> tuple[list[float], int]:
    """e^T P^-1 e at the marks, of the estimator's own covariance; its degrees of freedom."""
    if states is None:
        return [], 0
    at_marks = {name: values[marks] for name, values in states.items()}
    estimator = campaign.estimator
    where, wanted = f"estimator {estimator.name}, error_covariance", "names and covariances"
    covariances = called(
        estimator.error_covariance,
        at_marks,
        campaign.values,
        where=where,
        wanted=wanted,
        kind=tuple | None,
        answer="return (names, covariances) or None",
    )
    if covariances is None:
        return [], 0
    names, p = _checked(
        covariances, len(marks), {*states, *(o.name for o in estimator.outputs)}, where
    )
    if not set(names) <= set(errors):
        return [], 0
    e = np.stack([errors[name][marks] for name in names], axis=1)
    # In units of the standard deviations, since the scales of states may differ by much.
    variances = np.einsum("nii->ni", p)
    sd = np.sqrt(np.where(variances > 0.0, variances, np.nan))
    try:
        scaled = np.linalg.solve(p / sd[:, :, None] / sd[:, None, :], (e / sd)[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        raise InputError.at(
            where,
            wanted="covariances that are positive definite",
            found="a singular one",
            fix="leave out what follows from the others, or give it noise",
        ) from None
    return np.einsum("ni,ni->n", e / sd, scaled).tolist(), len(names)


def _checked(
    given: tuple[Any, ...], marks: int, known: set[str], where: str
) -> tuple[tuple[str, ...], FloatArray]:
    """Names and covariances of an estimator, if they are of its states and fit each other."""
    found = f"{len(given)} values"
    if len(given) == 2:
        names = (given[0],) if isinstance(given[0], str) else tuple(given[0])
        unknown = [name for name in names if name not in known]
        try:
            covariances: FloatArray = np.asarray(given[1], dtype=np.float64)
        except (TypeError, ValueError):
            found = f"a {type(given[1]).__name__} that holds no numbers"
        else:
            if not unknown and covariances.shape == (marks, len(names), len(names)):
                return names, covariances
            shapes = f"the shape {covariances.shape} of {len(names)} names"
            found = f"the name {unknown[0]!r}" if unknown else shapes
    raise InputError.at(
        where,
        wanted=f"names of states, and covariances of {marks} records, each a matrix of them",
        found=found,
        fix="return (names, covariances), an array (n, k, k) for k names",
    )
