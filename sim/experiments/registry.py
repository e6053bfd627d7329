"""Experiments by name, of installed packages, and in a user's file."""

from __future__ import annotations

from boresight.model.resolve import load
from boresight.sim.experiments.experiment import Experiment

#: Entry points of installed packages that are experiments.
EXPERIMENT_GROUP = "boresight.experiments"


def experiment_of(source: str | type[Experiment] | Experiment) -> Experiment:
    """The experiment that is meant: a name, ``file.py:Class``, a class or an object.

    Raises
    ------
    InputError
        Nothing of that name; a file that does not exist, does not import, or holds none.
    """
    return load(source, Experiment, "experiment", EXPERIMENT_GROUP)
