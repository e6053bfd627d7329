"""Millions of hostile updates: does a filter's covariance stay positive, and with float64?

boresight covariance mekf  # 10,000,000 updates
boresight covariance kalman.py --updates 200000  # one's own: states p00, p01, p11
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np

from boresight.arguments import check_number
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.estimators import FILTERS
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Arguments, EstimatorName, Option, Outcome, PythonOnly, Verb
from boresight.sharing import estimator_names
from boresight.sim.accuracy.covariance import CovarianceTrial, covariance_of, covariance_trial
from boresight.sim.accuracy.manoeuvres import hostile
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs, read_record

__all__ = ["P0", "covariance", "initial_covariances"]

#: Initial variances of an attitude, rad^2.
P0 = (1e-8, 1e-6, 1e-4, 1e-2, 1.0)
#: Share of their default of other initial variances; of initial deviations the roots.
SHARES = (1e-4, 1e-2, 1.0, 1e2, 1e4)
_STEPS = 20_000
#: Most updates: some weeks.
_MOST = 10**12


def initial_covariances(estimator: Estimator) -> list[dict[str, float]]:
    """Parameter sets of several initial covariances, of the parameters named ``p0_...``.

    Angles, in rad and rad^2, take each of `P0`, or its root. Where none is an angle, all take
    `SHARES` of their default, within their range; one empty set where there is none.
    """
    names = [p for p in estimator.params if p.name.startswith("p0_")]
    names = [p for p in names if p.unit in ("rad", "rad^2")] or names
    if not names:
        return [{}]
    sets = []
    for p0, share in zip(P0, SHARES, strict=True):
        one = {}
        for p in names:
            power = 1.0 if p.unit.endswith("^2") else 0.5
            angle = p.unit in ("rad", "rad^2")
            value = (p0 if angle else share) ** power * (1.0 if angle else p.default)
            one[p.name] = min(max(value, p.low), p.high)
        sets.append(one)
    return sets


def covariance(
    name: Named,
    *logs: Any,
    updates: int = 10_000_000,
    steps: Annotated[int, PythonOnly] = _STEPS,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C of a filter through hostile inputs and recordings.

    Once for each of several initial covariances (`initial_covariances`).

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        Recordings, or folders of them; by default the bundled one, where it feeds the filter.
    updates : int
        Of each filter.
    steps : int
        Length of each stimulus; it repeats.

    Returns
    -------
    CovarianceTrial
        Negative variances, least eigenvalue, drift from float64.

    Raises
    ------
    InputError
        Unknown estimator, one without a covariance, a bad log, or updates below 1.
    """
    check_number("updates", updates, 1, _MOST)
    estimator = find_estimator(name)
    covariance_of(estimator)
    records = hostile(estimator, steps, np.random.default_rng(1))
    records |= _recorded(estimator, logs, steps)
    params = initial_covariances(estimator)
    return covariance_trial(estimator, records, updates=updates, params=params, progress=progress)


def _recorded(estimator: Estimator, logs: Sequence[Any], steps: int) -> dict[str, np.ndarray]:
    """Inputs (n, n_inputs) of logs, by name."""
    if logs:
        read = [record.head(steps) for record, _ in read_logs(logs)]
        return {f"log {r.name}": feed(estimator, r).inputs for r in read}
    try:
        record = read_record(bundled("ximu_walk")).head(steps)
        return {"recorded": feed(estimator, record).inputs}
    except InputError:
        return {}  # it asks for other columns


def call(
    arguments: Arguments,
    *names: EstimatorName,
    log: Annotated[Sequence[str], Option(metavar="LOG", repeated=True)] = (),
) -> Outcome:
    """One after the other; all are known before the first begins.

    Parameters
    ----------
    names : estimators
        By default every Kalman filter of the main job.
    log : sequence of str
        Recording that is run besides, repeatable; by default the bundled one, if it fits.
    """
    every = estimator_names(*(names or FILTERS[1:]))
    for name in every:
        covariance_of(find_estimator(name))
    results = [arguments.call(covariance, name, *log) for name in every]
    good = all(trial.good for trial in results)
    data = {"good": good, "results": [trial.to_json() for trial in results]}
    return int(not good), data, "\n".join(map(str, results))


VERB = Verb(covariance, call=call)
