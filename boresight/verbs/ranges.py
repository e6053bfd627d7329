"""Ranges that an estimator states: proven, checked, or how far a search came to their ends.

boresight ranges my_filter.py  # all claims of ops.bounded, and the states' ranges
boresight ranges mekf --updates 1000000  # a longer search
boresight ranges mekf --witness broken.csv  # inputs that break a range, as a log
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np

from boresight.arguments import check_number
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import OutputFile
from boresight.options import Arguments, EstimatorName, Option, Outcome, Verb, Word
from boresight.sim.ranges.ranges import RangesResult, examine
from boresight.sim.records.files import content_of
from boresight.sim.records.record import Column, Record

__all__ = ["ranges"]

#: Most updates: some days.
_MOST = 10**10


def ranges(
    name: EstimatorName,
    *,
    word: Word = 32,
    updates: int = 100_000,
    seed: int = 1,
    witness: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    progress: Callable[[str], None] | None = None,
) -> RangesResult:
    """Prove, check or refute the ranges that an estimator states.

    Parameters
    ----------
    updates : int
        Of the search for inputs that reach or break a range.
    seed : int
        Of the search.
    witness : path, optional
        Log of the inputs that break the first refuted claim, from a reset on; else not written.

    Returns
    -------
    RangesResult
        One `ClaimResult` for each claim; ``good`` if none is refuted.

    Raises
    ------
    InputError
        Unknown or bad estimator, updates below 1, a file that cannot be written.
    """
    check_number("updates", updates, 1, _MOST)
    check_number("seed", seed, 0)
    estimator = find_estimator(name)
    target = None
    if witness is not None:
        target = OutputFile(witness, option="--witness")
    tell = progress or (lambda text: None)
    result = examine(estimator, word=word, updates=updates, seed=seed, progress=tell)
    refuted = [c for c in (*result.claims, *result.states) if c.status == "refuted"]
    broken = refuted[0].witness if refuted else None
    if witness is not None and target is not None and broken is not None:
        columns = {
            i.name: Column(np.array(broken.inputs[i.name]), i.unit or None)
            for i in estimator.inputs
        }
        target.write(content_of(witness, Record(estimator.name, columns)))
    return result


def call(arguments: Arguments) -> Outcome:
    """Examine one estimator."""
    result = arguments.call(ranges)
    return int(not result.good), result.to_json(), str(result)


VERB = Verb(ranges, call=call)
