"""Logs with a reference, on which filters are measured."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import units_of
from boresight.sim.accuracy.peers import PEERS, run_peer
from boresight.sim.records.bundled import bundled, bundled_names
from boresight.sim.records.feed import Feed, LongFeed, feed_of, fitted
from boresight.sim.records.log import Log, logs_of
from boresight.sim.records.nine_axis import NineAxis, truth_names
from boresight.sim.records.record import Column, Record
from boresight.sim.rotations.rotation import quaternion_multiply

__all__ = ["STAND_IN", "Trial", "read_trials"]

#: Peer whose estimate stands in where a log has no reference.
STAND_IN = "vqf_offline"


@dataclass(frozen=True, eq=False)
class Trial:
    """A log with a truth.

    ``reference``: "truth"; "comparison" (another device's estimate, in the log); or the name of
    the peer whose estimate stands for it. Only truth enters means. ``folder``: where the log is
    from. ``feeds``: estimators made for the log's rates and what they read of it, by name.
    """

    log: Log
    reference: str = "truth"
    folder: str = ""
    feeds: Mapping[str, tuple[Estimator, Feed | LongFeed]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the log."""
        return self.log.name

    @property
    def record(self) -> Record:
        """The log in memory, for published filters."""
        return self.log.first

    def fed(self, estimator: Estimator) -> tuple[Estimator, Feed | LongFeed]:
        """The estimator made for the log's rates, and its inputs from the log."""
        return self.feeds.get(estimator.name) or _fed(estimator, self.log)


def _fed(estimator: Estimator, log: Log) -> tuple[Estimator, Feed | LongFeed]:
    """The estimator made for the rates of a log, or of its first part, and its inputs."""
    member = fitted(estimator, log.first)
    return member, feed_of(member, log)


def read_trials(
    logs: Sequence[Any],
    estimators: Sequence[Estimator],
    *,
    comparisons: Collection[str] = (),
    peers: bool = False,
    declination_deg: float = 0.0,
) -> tuple[list[Trial], list[Log]]:
    """Trials of logs and folders (the bundled logs by default), and logs that are left out.

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`).
    comparisons : names of logs whose reference is another device's estimate, not truth.
    peers : bool
        Whether published filters run: then logs without reference are measured against `STAND_IN`;
        without them they are left out.
    declination_deg : float
        Of magnetic north, positive to the east, where references count from true north.

    Raises
    ------
    InputError
        A bad log, two logs of one name, a name among ``comparisons`` that no log has.
    """
    trials: dict[str, Trial] = {}
    left_out: dict[str, Log] = {}
    # Published filters hold a whole log.
    for log in logs_of(logs or [bundled(name) for name in bundled_names()], load=peers):
        if log.name in trials or log.name in left_out:
            raise InputError.at(
                log.first.where,
                wanted="logs of different names",
                found=log.name,
                fix="name each log once, or rename one",
            )
        log = log.through(partial(_from_magnetic_north, declination_deg))
        is_comparison = log.comparison or log.name in comparisons
        trial = _trial(log, estimators, "comparison" if is_comparison else "truth", peers)
        if trial is None:
            left_out[log.name] = log
        else:
            trials[log.name] = trial
    for name in comparisons:
        if name not in trials or trials[name].reference != "comparison":
            raise InputError.at(
                "--comparison",
                wanted="names of logs with a reference",
                found=repr(name),
                fix="write the file's name without its suffix",
            )
    return [trials[n] for n in sorted(trials)], [left_out[n] for n in sorted(left_out)]


def _from_magnetic_north(declination_deg: float, record: Record) -> Record:
    """A record whose reference counts from magnetic north, of one from true north."""
    names = truth_names(record)
    if not declination_deg or not all(n in names for n in QUATERNION):
        return record
    half = np.radians(declination_deg) / 2.0
    true = np.stack([record.values(names[n], "") for n in QUATERNION], axis=1)
    # v_magnetic = Rz(D) v_true: magnetic north (sin D, cos D, 0) becomes (0, 1, 0).
    q = quaternion_multiply((np.cos(half), 0.0, 0.0, np.sin(half)), true)
    columns = {names[n]: Column(q[:, k]) for k, n in enumerate(QUATERNION)}
    return record.derived({**record.columns, **columns})


def _trial(log: Log, estimators: Sequence[Estimator], reference: str, peers: bool) -> Trial | None:
    """A log as a trial; None where it has no truth and nothing stands in."""
    folder = "" if log.path is None else log.path.absolute().parent.name
    feeds = {e.name: _fed(e, log) for e in estimators}
    if any(units_of(*fed) for fed in feeds.values()):
        return Trial(log, reference, folder, feeds)
    if not peers:
        return None
    nine = NineAxis.of(log.first)
    if nine.q is not None and (np.isfinite(nine.q).all(axis=1) & nine.counts).any():
        return Trial(log, reference, folder, feeds)
    if not nine.mag_new.any():
        return None
    log = Log.in_memory(replace(nine, q=run_peer(PEERS[STAND_IN], log.first)).record(), log.path)
    return Trial(log, STAND_IN, folder, {e.name: _fed(e, log) for e in estimators})
