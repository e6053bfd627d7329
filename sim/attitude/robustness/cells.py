"""Logs in the cases of a protocol, as an estimator reads them, for the tuning of parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.sim.attitude.robustness.runs import counted, prepared
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Column, Record

__all__ = ["Cell", "cells"]


@dataclass(frozen=True)
class Cell:
    """One log in one case."""

    log: str
    case: Case
    given: Feed


def cells(estimator: Estimator, records: Sequence[Record], protocol: str) -> list[Cell]:
    """Every log in every case that needs no full scale; samples count as in the protocol.

    Only what is run and judged is kept of each, not the log's other columns.

    Raises
    ------
    InputError
        No such protocol, an estimator that gives no attitude, a log that a case leaves nothing of.
    """
    cases = [case for case in cases_of(protocol) if not case.full_scale]
    if not gives_attitude(estimator):
        raise InputError.at(
            estimator.name,
            wanted="an estimator whose outputs are an attitude, qw qx qy qz",
            found="another one",
            fix="leave --protocol out, or name another",
        )
    out = []
    for record in records:
        log = NineAxis.of(record)
        for case in cases:
            trial = prepared(case, log)
            columns = feed(estimator, replace(trial, mov=counted(trial)).record())
            head = Record(
                record.name, {"t": Column(trial.t[:1].copy())}, record.place, record.source
            )
            out.append(Cell(log.name, case, replace(columns, record=head, new=columns.new[:0])))
    return out
