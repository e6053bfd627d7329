"""What parameters are tuned on: logs with truth, or these in every case of a protocol."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import units_of
from boresight.sim.attitude.robustness.cells import cells
from boresight.sim.records.feed import Feed, LongFeed, feed_of
from boresight.sim.records.log import Log, logs_of

__all__ = ["Trials", "trials_of"]


@dataclass(frozen=True)
class Trials:
    """What is run.

    Attributes
    ----------
    feeds : tuple of Feed or LongFeed
    names, logs : tuple of str
        Of each its name, and the log that it is made of.
    units : dict of str to str
        Of the figures.
    left_out : tuple of str
        Logs without truth.
    scored : tuple of (name, figure), optional
        Of each the figure that counts, by the name of its group of cases.
    """

    feeds: tuple[Feed | LongFeed, ...]
    names: tuple[str, ...]
    logs: tuple[str, ...]
    units: dict[str, str]
    left_out: tuple[str, ...]
    scored: tuple[tuple[str, str], ...] | None = None

    def held_back(self, hold: str) -> tuple[str, ...]:
        """Of each the name that it is held back with: "logs" its log, "cases" its group.

        Raises
        ------
        InputError
            Neither of them, or cases of none.
        """
        if hold not in ("logs", "cases") or (hold == "cases" and self.scored is None):
            raise InputError.at(
                "hold",
                wanted="logs, or with a protocol cases",
                found=repr(hold),
                fix="hold logs back, or name a protocol",
            )
        return (
            self.logs if hold == "logs" or self.scored is None else tuple(n for n, _ in self.scored)
        )


def trials_of(estimator: Estimator, logs: Sequence[Any], protocol: str | None) -> Trials:
    """Logs with truth in the order of their names, in every case of a protocol if one is named.

    Raises
    ------
    InputError
        Bad logs, none with truth, no such protocol or none for this estimator.
    """
    trials: list[tuple[Log, Feed | LongFeed, dict[str, str]]] = []
    left_out: list[str] = []
    for log in logs_of(logs, load=protocol is not None):
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
    if protocol is None:
        units = {n: u for _, _, of in trials for n, u in of.items()}
        names = tuple(log.name for log, _, _ in trials)
        return Trials(tuple(columns for _, columns, _ in trials), names, names, units, lost)
    held = cells(estimator, [log.first for log, _, _ in trials], protocol)
    return Trials(
        tuple(c.given for c in held),
        tuple(f"{c.log}, {c.case.name}" for c in held),
        tuple(c.log for c in held),
        {c.case.group: "deg" for c in held},
        lost,
        tuple((c.case.group, c.case.judged) for c in held),
    )
