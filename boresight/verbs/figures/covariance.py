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
from boresight.sim.accuracy.covariance import (
    CovarianceTrial,
    covariance_of,
    covariance_trial,
    initial_covariances,
)
from boresight.sim.accuracy.manoeuvres import hostile
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs, read_record

__all__ = ["covariance"]

_STEPS = 20_000
#: Most updates: some weeks.
_MOST = 10**12


def covariance(
    name: Named,
    *logs: Any,
    updates: int = 10_000_000,
    seed: int = 1,
    steps: Annotated[int, PythonOnly] = _STEPS,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C of a filter through hostile inputs and recordings.

    Once for each of several initial covariances (`sim.accuracy.covariance.initial_covariances`).

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        Recordings, or folders of them; by default the bundled one, where it feeds the filter.
    updates : int
        Of each filter.
    seed : int
        Of the hostile inputs.
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
    check_number("seed", seed, 0)
    estimator = find_estimator(name)
    covariance_of(estimator)
    records = hostile(estimator, steps, np.random.default_rng(seed))
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
