"""Logs with a truth, on which estimators are measured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import ANGLES, units_of
from boresight.sim.records.bundled import bundled, bundled_names
from boresight.sim.records.feed import Feed, LongFeed, feed_of, fitted
from boresight.sim.records.files import Log, logs_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.worlds.world import is_world


@dataclass(frozen=True, eq=False)
class Trial:
    """A log with a truth, which allows errors in ``units``.

    ``feeds`` are by name the estimator made for the rates of the log, and its inputs.
    """

    log: Log
    feeds: Mapping[str, tuple[Estimator, Feed | LongFeed]]
    units: Mapping[str, str]

    @property
    def name(self) -> str:
        """Name of the log."""
        return self.log.name

    @property
    def warnings(self) -> dict[str, None]:
        """What the reader warns of, once for all estimators."""
        fed = (columns for _, columns in self.feeds.values())
        return {f"{self.name}: {text}": None for columns in fed for text in columns.warnings}

    @property
    def reference(self) -> str:
        """What the log's reference is: "truth", or "comparison", the estimate of another device."""
        return "comparison" if self.log.comparison else "truth"


def read_trials(
    logs: Sequence[Any], estimators: Sequence[Estimator], *, load: bool = False
) -> tuple[list[Trial], list[Log]]:
    """Logs with truth, in the order of their names, and the logs that are left out.

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        By default the bundled logs. Logs of the same name are named with their folders.
    load : bool
        Hold whole logs in memory, as published filters need.

    Raises
    ------
    InputError
        A bad log, a log named twice, or no log with truth.
    """
    if any(map(is_world, logs)):
        fix = "record it first: boresight run ESTIMATOR WORLD -o log.csv"
        raise InputError.at("logs", wanted="logs", found="a world", fix=fix)
    trials, left_out = list[Trial](), list[Log]()
    found = logs_of(logs or [bundled(name) for name in bundled_names()], load=load)
    for log in sorted(_distinct(found), key=lambda log: log.name):
        members = [fitted(e, log.first) for e in estimators]
        feeds = {
            e.name: (member, feed_of(member, log))
            for e, member in zip(estimators, members, strict=True)
        }
        units = {name: unit for fed in feeds.values() for name, unit in units_of(*fed).items()}
        if load and not units and _has_attitude(log):
            units = dict.fromkeys(ANGLES, "deg")
        if units:
            trials.append(Trial(log, feeds, units))
        else:
            left_out.append(log)
    if not trials:
        example = estimators[0].outputs[0].name if estimators else "qw"
        raise InputError.at(
            "logs",
            wanted=f"at least one log with the truth of an output, as {example}_true",
            found="none",
            fix="name logs with truth",
        )
    return trials, left_out


def _has_attitude(log: Log) -> bool:
    """Whether a log of nine axes has a reference attitude."""
    nine = NineAxis.of(log.first)
    return nine.q is not None and bool((np.isfinite(nine.q).all(axis=1) & nine.counts).any())


def _distinct(logs: Sequence[Log]) -> list[Log]:
    """Logs with different names: of equal ones ``FOLDER/NAME``."""
    counts, named = Counter(log.name for log in logs), dict[str, Log]()
    for log in logs:
        name = log.name
        if counts[name] > 1 and log.path is not None:
            name = f"{log.path.absolute().parent.name}/{name}"
        require(name not in named, "logs", "each once", f"{name} twice", "name it once")
        named[name] = replace(log, name=name)
    return [*named.values()]
