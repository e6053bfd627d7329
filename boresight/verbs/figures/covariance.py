"""Millions of hostile updates: does a filter's covariance stay positive, and with float64?

boresight covariance mekf  # 10,000,000 updates
boresight covariance kalman.py --updates 200000  # one's own: states p00, p01, p11
boresight covariance carts.py:CartMotion,carts.py:CartSeen  # a covariance of both, in turns
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np

from boresight.arguments import check_number
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.linking import families
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import (
    Arguments,
    EstimatorName,
    EstimatorNames,
    Option,
    Outcome,
    PythonOnly,
    Verb,
)
from boresight.sharing import estimator_names
from boresight.sim.accuracy.covariance import (
    CovarianceTrial,
    covariance_of,
    covariance_trial,
    initial_covariances,
)
from boresight.sim.accuracy.manoeuvres import WITHIN, hostile, within
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs, read_record

__all__ = ["covariance"]

_STEPS = 20_000
#: Most updates: some weeks.
_MOST = 10**12


def covariance(
    name: EstimatorNames,
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
    name : str, class or Estimator
        Name, or FILE.py:CLASS; with commas those that share their states (`Estimator.shares`),
        which update them in random turns.
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
    several = [find_estimator(n) for n in estimator_names(name)]
    covariance_of(several[0])
    if len({*families(several)}) > 1:
        raise InputError.at(
            ", ".join(e.name for e in several),
            wanted="estimators that share the states of one of them",
            found="states of their own",
            fix="try one after the other",
        )
    rng = np.random.default_rng(seed)
    records = (
        {stimulus: [inputs] for stimulus, inputs in hostile(several[0], steps, rng).items()}
        if len(several) == 1
        else {w: [within(e, w, steps, rng) for e in several] for w in WITHIN}
    )
    records |= _recorded(several, logs, steps)
    params = initial_covariances(several[0])
    return covariance_trial(several, records, updates=updates, params=params, progress=progress)


def _recorded(
    several: Sequence[Estimator], logs: Sequence[Any], steps: int
) -> dict[str, list[np.ndarray]]:
    """Inputs (n, n_inputs) of each estimator of logs, by name."""
    if logs:
        read = [record.head(steps) for record, _ in read_logs(logs)]
        return {f"log {r.name}": [feed(e, r).inputs for e in several] for r in read}
    try:
        record = read_record(bundled("ximu_walk")).head(steps)
        return {"recorded": [feed(e, record).inputs for e in several]}
    except InputError:
        return {}  # it asks for other columns


def call(
    arguments: Arguments,
    *names: EstimatorName,
    log: Annotated[Sequence[str], Option(metavar="LOG", repeated=True)] = (),
) -> Outcome:
    """One after the other, those with states of others with these; all are known before.

    Parameters
    ----------
    names : estimators
        By default every Kalman filter of the main job.
    log : sequence of str
        Recording that is run besides, repeatable; by default the bundled one, if it fits.
    """
    every = estimator_names(*(names or ("ekf_quaternion", "ekf_bias", "mekf")))
    known = [find_estimator(name) for name in every]
    for estimator in known:
        covariance_of(estimator)
    of = families(known)
    together = [
        ",".join(str(n) for n, k in zip(every, of, strict=True) if k == o)
        for o in dict.fromkeys(of)
    ]
    results = [arguments.call(covariance, name, *log) for name in together]
    good = all(trial.good for trial in results)
    data = {"good": good, "results": [trial.to_json() for trial in results]}
    return int(not good), data, "\n".join(map(str, results))


VERB = Verb(covariance, call=call)
