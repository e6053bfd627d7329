"""A campaign: the draws of one world, run through one estimator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from itertools import count, takewhile
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray, IntArray
from boresight.model.declarations import PERIODS
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, estimator_of
from boresight.sim.accuracy.covariance import own_covariance
from boresight.sim.campaign import digest, sources
from boresight.sim.compare.verdict import saturations
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level
from boresight.sim.levels.registry import make_level
from boresight.sim.rotations.zyx import wrapped
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.sim.worlds.world import NamedWorld, World, drawn, world_of

MARKS = 50  #: Records of the first draw at which errors are stored, at most.


@dataclass(eq=False)
class Campaign:
    """World, estimator and level of all draws, made on first use, once in each process.

    `InputError` on first use: see `world_of`, `estimator_of` and `Build`.
    """

    #: World and estimator as texts, classes or objects; another process can make only texts.
    named: tuple[NamedWorld, Named]
    params: tuple[tuple[str, float], ...] = ()  #: values other than the defaults, sorted by name.
    on: str = "c"  #: level.
    word: int = 32  #: bits.
    steps: int | None = None  #: most records of a draw.
    length: int = MARKS  #: records of the first draw, which the marks are chosen from.

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
        """Everything that determines a draw of a given seed, as plain data."""
        world, estimator = self.named
        return {
            "world": world if isinstance(world, str) else self.world.name,
            "estimator": estimator if isinstance(estimator, str) else self.estimator.name,
            "sources": sources(self.world, self.estimator),
            "program": self.level.program.digest,
            "params": dict(self.params),
            "level": self.on,
            "word": self.word,
            "steps": self.steps,
        }

    def marks(self, records: int) -> IntArray:
        """Records of a draw of so many at which its errors are stored.

        They are spread over the length of the first draw, its last record included, and continue
        at the same distance in a longer one: mark k is the same record in every draw.
        """
        marks = np.linspace(0, self.length - 1, min(self.length, MARKS)).round().astype(int)
        step = max(1, -(-self.length // MARKS))
        more: Iterator[int] = takewhile(lambda k: k < records, count(self.length - 1 + step, step))
        return np.array([*marks[marks < records], *more], dtype=int)

    def __reduce__(self) -> tuple[Any, ...]:
        """Its fields, and the digest of its identity, so that a change is noticed."""
        values = (getattr(self, field.name) for field in fields(self))
        return _received, (digest(self.identity), *values)


@lru_cache(maxsize=2)
def _received(_: str, *values: Any) -> Campaign:
    """A campaign of another process: all batches of it share one."""
    return Campaign(*values)


def record_count(campaign: Campaign, seed: int) -> int:
    """Number of records of a draw."""
    return len(_loop(campaign, seed).inputs)


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


def _loop(campaign: Campaign, seed: int) -> Loop:
    """The closed loop of a draw."""
    drawn(campaign.world, seed)
    loop = close_loop(campaign.world, campaign.level, steps=campaign.steps)
    wanted = f"the truth of an output of {campaign.estimator.name}"
    fix = "give NAME_true with the records"
    require(bool(loop.truth), f"world {campaign.world.name}", wanted, None, fix)
    return loop


def _draw(campaign: Campaign, seed: int) -> dict[str, Any]:
    """Results of one draw.

    ``seed``; ``records``; ``errors``, outputs less truth at the marks, by name; ``last``, the same
    at the last record; ``nees`` and ``freedom``, squared error over the estimator's covariance;
    ``nis``, sum and number of squared normalised innovations; ``saturated`` updates, and by the
    name of the value ``saturations``.
    """
    loop = _loop(campaign, seed)
    estimator, level, run = campaign.estimator, campaign.level, loop.run
    marks = campaign.marks(len(loop.inputs))
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
    # P is the covariance of the states: an output of the same name may be a prediction.
    nees, freedom = _nees(campaign, states, errors | errors_of(states or {}), marks)
    nis = loop.outputs["nis"] if estimator.nis_freedom else np.zeros(0)
    positive = nis[nis > 0.0]
    return {
        "seed": seed,
        "records": len(loop.inputs),
        "errors": {name: errors[name][marks].tolist() for name in loop.truth},
        "last": {name: float(errors[name][-1]) for name in loop.truth},
        "nees": nees,
        "freedom": freedom,
        "nis": [float(positive.sum()), len(positive)],
        "saturated": run.n_saturated,
        "saturations": saturations(level, [(loop.inputs, True)]) if run.n_saturated else {},
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
    own = own_covariance(estimator, at_marks, campaign.values)
    if own is None or not set(own[0]) <= set(errors):
        return [], 0
    names, p = own
    e = np.stack([errors[name][marks] for name in names], axis=1)
    # In units of the standard deviations, since the scales of states may differ by much.
    variances = np.einsum("nii->ni", p)
    sd = np.sqrt(np.where(variances > 0.0, variances, np.nan))
    try:
        scaled = np.linalg.solve(p / sd[:, :, None] / sd[:, None, :], (e / sd)[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        raise InputError.at(
            f"estimator {estimator.name}, error_covariance",
            wanted="covariances that are positive definite",
            found="a singular one",
            fix="leave out what follows from the others, or give it noise",
        ) from None
    return np.einsum("ni,ni->n", e / sd, scaled).tolist(), len(names)
