"""A campaign: the draws of one world, run through one estimator, and their figures.

The figures are means and spreads with confidence bands, NEES, NIS, and the spread over the bound.
A mean of n draws has the band +-1.96 sd/sqrt(n), a standard deviation sd sqrt(chi2/(n - 1)); NEES
and NIS of f degrees of freedom, averaged over n independent draws, the band chi2(n f)/n. Quantiles
of chi2 by Wilson and Hilferty (Proc. Natl. Acad. Sci. 17, 1931): within a hundredth from ten
degrees on. NIS counts every record: a correct filter has white innovations.

Draws may end at different records. A figure at a mark is over the draws that reach it; marks that
fewer than two draws reach are left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from itertools import count, takewhile
from typing import Any

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray, IntArray
from boresight.model.declarations import PERIODS, Output
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, estimator_of
from boresight.sim.accuracy.covariance import own_covariance
from boresight.sim.campaign import digest, sources
from boresight.sim.compare.difference import unjudged
from boresight.sim.compare.verdict import saturated_text, saturations
from boresight.sim.levels.build import Build, Level, states_of
from boresight.sim.levels.registry import make_level
from boresight.sim.result import Result, Row
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
        return world_of(self.named[0])

    @cached_property
    def estimator(self) -> Estimator:
        return estimator_of(self.named[1])

    @cached_property
    def values(self) -> dict[str, float]:
        return self.estimator.param_values(dict(self.params))

    @cached_property
    def level(self) -> Level:
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
    drawn(campaign.world, seed)
    loop = close_loop(campaign.world, campaign.level, steps=campaign.steps)
    wanted = f"the truth of an output of {campaign.estimator.name}"
    fix = "give NAME_true with the records"
    require(bool(loop.truth), f"world {campaign.world.name}", wanted, None, fix)
    return loop


def _draw(campaign: Campaign, seed: int) -> dict[str, Any]:
    """Results of one draw.

    ``seed``; ``records``; ``errors``, outputs less truth at the marks, by name: infinite where the
    output is no number, else NaN without a true value; ``last``, the last that is known; ``nees``
    and ``freedom``, squared error over the estimator's covariance, NaN as the errors; ``nis``, sum
    and number of squared normalised innovations; ``saturated`` updates, and by the name of the
    value ``saturations``.
    """
    loop = _loop(campaign, seed)
    estimator, level, run = campaign.estimator, campaign.level, loop.run
    marks = campaign.marks(len(loop.inputs))
    units = {o.name: o.unit for o in estimator.outputs}
    states = None if run.states is None else states_of(level.program, run.states)

    @np.errstate(invalid="ignore")  # an output may be no number
    def errors_of(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        errors = {}
        for name in loop.truth.keys() & values.keys():
            error, period = values[name] - loop.truth[name], PERIODS.get(units[name])
            error = error if period is None else wrapped(error, period)
            errors[name] = np.where(np.isfinite(values[name]), error, np.inf)
        return errors

    errors = errors_of(loop.outputs)
    known = {name: ~np.isnan(errors[name]) for name in loop.truth}
    # P is the covariance of the states: an output of the same name may be a prediction.
    nees, freedom = _nees(campaign, states, errors | errors_of(states or {}), marks)
    nis = loop.outputs["nis"] if estimator.nis_freedom else np.zeros(0)
    positive = nis[nis > 0.0]
    return {
        "seed": seed,
        "records": len(loop.inputs),
        "errors": {name: errors[name][marks].tolist() for name in loop.truth},
        "last": {name: float(np.append(np.nan, errors[name][known[name]])[-1]) for name in known},
        "nees": nees,
        "freedom": freedom,
        "nis": [float(positive.sum()), len(positive)],
        "saturated": run.n_saturated,
        "saturations": saturations(level, [(loop.inputs, True)]) if run.n_saturated else {},
    }


@np.errstate(invalid="ignore")  # an error may be infinite
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
        where = f"estimator {estimator.name}, error_covariance"
        wanted = "covariances that are positive definite"
        fix = "leave out what follows from the others, or give it noise"
        raise InputError.at(where, wanted=wanted, found="a singular one", fix=fix) from None
    nees = np.einsum("ni,ni->n", e / sd, scaled)
    nees[np.isnan(nees) & ~np.isnan(e).any(axis=1)] = np.inf
    return nees.tolist(), len(names)


_Z = 1.959963984540054  #: Normal quantile of 95 %, two-sided.


def chi2(freedom: Any, z: float) -> FloatArray:
    """Quantile of chi2 that has the probability of the normal quantile ``z``."""
    freedom = np.maximum(np.asarray(freedom, dtype=np.float64), 1.0)
    part = 2.0 / (9.0 * freedom)
    return np.asarray(freedom * np.maximum(1.0 - part + z * np.sqrt(part), 0.0) ** 3)


def band(freedom: Any, scale: Any) -> FloatArray:
    """95 % of chi2/scale: low and high, (2, ...)."""
    return np.stack([chi2(freedom, -_Z) / scale, chi2(freedom, _Z) / scale])


@np.errstate(all="ignore")  # a mark may be without true values
def figures(
    draws: Sequence[Mapping[str, Any]],
    marks: IntArray,
    bound: Mapping[str, FloatArray],
    freedom: int,
) -> dict[str, Any]:
    """Figures of a campaign, as arrays and numbers.

    ``draws`` are in the order of their seeds; ``marks`` (n,) the records at which the longest one
    holds errors; ``bound`` has least standard deviations (records,) by output; ``freedom`` are the
    degrees of freedom of the innovations.

    Returns ``marks``, and by mark ``draws``, how many reach it; ``common``, the index of the last
    mark that all reach, with true values if any has; ``outputs`` by name with arrays over the
    marks: ``mean``, ``mean_band`` (half of it), ``sd``, ``sd_band`` (2, marks), ``rms``, ``bound``
    and ``ratio`` of sd to it, and of those with a true value ``rms_all``, one number; ``nees`` with
    ``mean`` and ``band`` (2, marks), per degree of freedom; ``nis`` the same, one number;
    ``saturated`` updates, ``saturated_draws``, and by the name of the value ``saturations``;
    ``worst``, see `_worst`.
    """
    reach = np.array([np.searchsorted(marks, draw["records"]) for draw in draws])
    marks = marks[: np.sort(reach)[-2]]
    reached = np.arange(len(marks)) < reach[:, None]
    n = reached.sum(axis=0)
    outputs = {}
    for name in draws[0]["errors"]:
        e = _padded([draw["errors"][name] for draw in draws], reached)
        known = ~np.isnan(e)
        judged = known.sum(axis=0)
        mean, others = e.sum(axis=0, where=known) / judged, np.maximum(judged - 1, 0)
        sd = np.sqrt(np.sum((e - mean) ** 2, axis=0, where=known) / others)
        outputs[name] = {
            "mean": mean,
            "mean_band": _Z / np.sqrt(judged) * sd,
            "sd": sd,
            "sd_band": sd / np.sqrt(band(others, others)[::-1]),
            "rms": np.sqrt(np.sum(e**2, axis=0, where=known) / judged),
        }
        if known.any():
            outputs[name]["rms_all"] = float(np.sqrt(np.mean(e**2, where=known)))
        if name in bound:
            least = np.asarray(bound[name], dtype=np.float64)[marks]
            least[~(np.isfinite(least) & (least > 0.0))] = np.nan
            outputs[name] |= {"bound": least, "ratio": sd / least}
    seen = ~np.logical_and.reduce([np.isnan(of["mean"]) for of in outputs.values()])
    out: dict[str, Any] = {
        "marks": marks,
        "draws": n,
        "common": int(max(np.flatnonzero(n == len(draws)), key=lambda k: (seen[k], k))),
        "outputs": outputs,
    }
    if f := draws[0]["freedom"]:
        of = _padded([draw["nees"] for draw in draws], reached)
        freedoms = (~np.isnan(of)).sum(axis=0) * f
        mean = np.nansum(of, axis=0) / freedoms
        out["nees"] = {"freedom": f, "mean": mean, "band": band(freedoms, freedoms)}
    count = sum(draw["nis"][1] for draw in draws) * freedom
    if count:
        mean = sum(draw["nis"][0] for draw in draws) / count
        out["nis"] = {"freedom": freedom, "mean": mean, "band": band(count, count)}
    saturations = sum((Counter(draw["saturations"]) for draw in draws), Counter[str]())
    return out | {
        "saturated": sum(draw["saturated"] for draw in draws),
        "saturated_draws": sum(draw["saturated"] > 0 for draw in draws),
        "saturations": dict(saturations),
        "worst": _worst(draws),
    }


def _padded(rows: Sequence[Sequence[float]], reached: BoolArray) -> FloatArray:
    """Rows of different lengths as an array, with NaN where nothing is reached."""
    values = np.full(reached.shape, np.nan)
    for row, mask, given in zip(values, reached, rows, strict=True):
        row[mask] = given[: mask.sum()]
    return values


def _worst(draws: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The draw in which most updates saturated; of equal ones, the one with the largest last error.

    Errors are compared by their ratio to the root mean square of the output over the draws.
    """
    names = [*draws[0]["last"]]
    last = np.abs([[draw["last"][name] for name in names] for draw in draws])
    finite = np.isfinite(last)
    rms = np.sqrt((np.where(finite, last, 0.0) ** 2).sum(axis=0) / finite.sum(axis=0))
    times = last / np.where(rms > 0.0, rms, 1.0)
    times[np.isnan(times)] = -1.0  # without any true value
    k = max(range(len(draws)), key=lambda k: (draws[k]["saturated"], times[k].max()))
    j = int(np.argmax(times[k]))
    worst = {"seed": draws[k]["seed"], "output": names[j], "saturated": draws[k]["saturated"]}
    return worst | {"error": float(last[k, j]), "times_rms": float(times[k, j])}


def result_of(data: Mapping[str, Any], outputs: Sequence[Output]) -> Result:
    """The result of a campaign: its identity and figures, with tables of the last common mark.

    It fails if an update saturated, or if ``rms_all`` of an output is above its `Output.truth`.
    """
    units = {o.name: o.unit for o in outputs}
    k = data["common"]
    record, worst = int(data["marks"][k]), data["worst"]
    columns = {"mean error": "mean", "+-": "mean_band", "sd": "sd", "bound": "bound"}
    columns["sd/bound"] = "ratio"
    spreads: list[Row] = [
        {"output": name, **{head: entry.get(key, {k: None})[k] for head, key in columns.items()}}
        | {"unit": units.get(name, "")}
        for name, entry in data["outputs"].items()
    ]
    consistency: list[Row] = []
    if "nees" in data:
        nees = data["nees"]
        consistency.append(_consistency("NEES", nees["mean"][k], nees["band"][:, k]))
    if "nis" in data:
        consistency.append(_consistency("NIS", data["nis"]["mean"], data["nis"]["band"]))
    error = f"{worst['error']:.4g} {units.get(worst['output'], '')}".rstrip()
    error = f"{worst['output']} off by {error} at its end, " * (not math.isnan(worst["error"]))
    lines = [
        f"{data['runs']} draws, saturated updates: {data['saturated']}, "
        f"in {data['saturated_draws']} draws",
        f"worst draw: seed {worst['seed']}, {error}saturated updates: {worst['saturated']}",
        *([f"run it again: {worst['command']}"] if worst.get("command") else []),
    ]
    failures = []
    if saturated := data["saturated"]:
        draws = f" in {data['saturated_draws']} of {data['runs']} draws"
        failures.append(saturated_text(saturated, data["saturations"]) + draws)
    all_rms = {name: of["rms_all"] for name, of in data["outputs"].items() if "rms_all" in of}
    limits = {o.name: o.truth for o in outputs if o.truth is not None and o.name in all_rms}
    for name, limit in limits.items():
        if not (rms := all_rms[name]) <= limit:
            text = f"{name} rms {rms:.3g} {units[name]} over all draws: BEYOND {limit:.3g}"
            failures.append(text)
    notes = unjudged(outputs, all_rms)
    none = "no output" if notes else "no output, since none has truth="
    lines.append(f"judged against truth: {', '.join(limits) or none}")
    tables: dict[str, list[Row]] = {
        f"errors in record {record}": spreads,
        f"per degree of freedom; NEES in record {record}": consistency,
    }
    return Result(data, tables, "\n".join(lines), notes, failures)


def _consistency(name: str, mean: float, limits: FloatArray) -> Row:
    """A squared error over its variance, and what it says of the filter."""
    low, high = map(float, limits)
    if not np.isfinite(mean):
        verdict = "not computed: an error is NaN or a covariance is not positive definite"
    elif mean > high:
        verdict = "too sure: errors are larger than the filter says (more noise)"
    elif mean < low:
        verdict = "too cautious: errors are smaller than the filter says (less noise)"
    else:
        verdict = "consistent"
    return {"": name, "mean": float(mean), "low": low, "high": high, "verdict": verdict}
