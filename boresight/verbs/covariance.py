"""`boresight covariance`: is the covariance of a filter positive, whatever comes?"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from boresight.arguments import check_number
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, progress_of
from boresight.sharing import estimator_names
from boresight.sim.accuracy.covariance_trial import (
    MANOEUVRES,
    CovarianceTrial,
    covariance_trial,
    manoeuvre,
)
from boresight.sim.attitude.feed import inputs_of
from boresight.sim.attitude.log import read_log
from boresight.sim.records.bundled import bundled
from boresight.verbs.demo import FILTERS

__all__ = ["P0", "add_arguments", "call", "covariance", "initial_covariances"]

#: Initial variances of the attitude, rad^2.
P0 = (1e-8, 1e-6, 1e-4, 1e-2, 1.0)
_STEPS = 20_000
#: Most updates: some weeks.
_MOST = 10**12


def initial_covariances(estimator: Estimator) -> list[dict[str, float]]:
    """A parameter set for each of `P0`: variances where the unit is rad^2, else their roots."""
    units = {
        p.name: p.unit
        for p in estimator.params
        if p.name.startswith("p0_") and p.unit in ("rad", "rad^2")
    }
    if not units:
        raise InputError.at(
            estimator.name,
            wanted="a Kalman filter with initial covariance",
            found="none",
            fix="choose one of the filters whose name has ekf",
        )
    return [{name: p0 if unit == "rad^2" else p0**0.5 for name, unit in units.items()} for p0 in P0]


def covariance(
    name: Named,
    *,
    updates: int = 10_000_000,
    steps: int = _STEPS,
    progress: Callable[[str], None] | None = None,
) -> CovarianceTrial:
    """Run the C model of a filter through hostile manoeuvres and a recording.

    Once for each initial covariance from 1e-8 to 1 rad^2.

    Parameters
    ----------
    steps : int
        Length of each stimulus; it repeats.

    Raises
    ------
    InputError
        Unknown estimator, one without a covariance, or updates below 1.
    """
    check_number("updates", updates, 1, _MOST)
    estimator = find_estimator(name)
    params = initial_covariances(estimator)
    rng = np.random.default_rng(1)
    records = {m: manoeuvre(m, steps, rng) for m in MANOEUVRES}
    records["recorded"] = inputs_of(estimator, read_log(Path(bundled("ximu_walk"))))[:steps]
    return covariance_trial(estimator, records, updates=updates, params=params, progress=progress)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "estimators",
        nargs="*",
        metavar="ESTIMATOR",
        help="which; by default every Kalman filter of the main job",
    )
    parser.add_argument("--updates", type=int, default=10_000_000, help="of each filter")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    names = estimator_names(*(args.estimators or FILTERS[1:]))
    for name in names:
        initial_covariances(find_estimator(name))  # all are known before the first begins
    found = [covariance(name, updates=args.updates, progress=progress_of(args)) for name in names]
    good = all(trial.good for trial in found)
    data = {"good": good, "results": [{**asdict(t), "good": t.good} for t in found]}
    return 0 if good else 1, data, "\n".join(t.line() for t in found)
