"""`boresight covariance`: is the covariance of a filter positive, whatever comes?"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from boresight.arguments import check_number
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.estimators import FILTERS
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, progress_of
from boresight.sharing import estimator_names
from boresight.sim.accuracy.covariance import CovarianceTrial, covariance_of, covariance_trial
from boresight.sim.accuracy.manoeuvres import hostile
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs, read_record

__all__ = ["P0", "add_arguments", "call", "covariance", "initial_covariances"]

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
    steps: int = _STEPS,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C of a filter through hostile inputs and recordings.

    Once for each of several initial covariances (`initial_covariances`).

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        Recordings, or folders of them; by default the bundled one, where it feeds the filter.
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


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "estimators",
        nargs="*",
        metavar="ESTIMATOR",
        help="which; by default every Kalman filter of the main job",
    )
    parser.add_argument(
        "--log",
        action="append",
        default=[],
        metavar="LOG",
        help="recording that is run besides, repeatable; default: the bundled one, if it fits",
    )
    parser.add_argument("--updates", type=int, default=10_000_000, help="of each filter")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    names = estimator_names(*(args.estimators or FILTERS[1:]))
    for name in names:
        covariance_of(find_estimator(name))  # all are known before the first begins
    found = [
        covariance(name, *args.log, updates=args.updates, progress=progress_of(args))
        for name in names
    ]
    good = all(trial.good for trial in found)
    data = {"good": good, "results": [t.to_json() for t in found]}
    return 0 if good else 1, data, "\n".join(str(t) for t in found)
