"""What parameters are tuned on: logs with truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import units_of
from boresight.sim.records.feed import Feed, LongFeed, feed_of
from boresight.sim.records.log import Log, logs_of

__all__ = ["Trials", "trials_of"]


@dataclass(frozen=True)
class Trials:
    """What is run.

    Attributes
    ----------
    feeds : tuple of Feed or LongFeed
    names : tuple of str
        Names of the logs.
    units : dict of str to str
        Of the figures.
    left_out : tuple of str
        Logs without truth.
    """

    feeds: tuple[Feed | LongFeed, ...]
    names: tuple[str, ...]
    units: dict[str, str]
    left_out: tuple[str, ...]


def trials_of(estimator: Estimator, logs: Sequence[Any]) -> Trials:
    """Logs with truth in the order of their names.

    Raises
    ------
    InputError
        Bad logs, or none with truth.
    """
    trials: list[tuple[Log, Feed | LongFeed, dict[str, str]]] = []
    left_out: list[str] = []
    for log in logs_of(logs):
        columns = feed_of(estimator, log)
        if (units := units_of(estimator, columns)) and not log.comparison:
            trials.append((log, columns, units))
        else:
            left_out.append(log.name)
    if not trials:
        raise InputError.at(
            "logs",
            wanted=f"at least one log with a truth of {estimator.name}'s outputs, as "
            f"{estimator.outputs[0].name}_true",
            found="none",
            fix="name logs with truth",
        )
    trials.sort(key=lambda t: t[0].name)
    lost = tuple(sorted(left_out))
    units = {n: u for _, _, of in trials for n, u in of.items()}
    return Trials(
        tuple(columns for _, columns, _ in trials),
        tuple(log.name for log, _, _ in trials),
        units,
        lost,
    )
