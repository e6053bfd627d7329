"""Hours of records: the integer C over all of them, float64 beside it, few of them kept.

Millions of records do not fit into memory with all that they give: they come piece by piece, and
only what is asked for stays.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from boresight.model.words.fixed import IntArray
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.records.reader import InputReader
from boresight.sim.records.record import index_place

__all__ = ["Endurance", "endurance"]

FloatArray = npt.NDArray[np.float64]
_WORD = 32  #: bits of an output ``bits`` that are counted.


@dataclass(eq=False)
class Endurance:
    """Result of a long run.

    Attributes
    ----------
    outputs : dict of str to float64 (n,)
        Of the records that were to be kept, in the outputs' units.
    square, most : dict of str to float
        By output that was compared: mean square, and most, of its difference from float64.
    saturated : int
        Updates in which an operation was clamped.
    least_eigenvalue : float
        Of the covariances that were looked at, in LSB; infinite if none was.
    counts : dict of str to int64 (32,)
        For each output of bits, in how many records each bit was set.
    records : int
    """

    outputs: dict[str, FloatArray] = field(default_factory=dict)
    square: dict[str, float] = field(default_factory=dict)
    most: dict[str, float] = field(default_factory=dict)
    saturated: int = 0
    least_eigenvalue: float = math.inf
    counts: dict[str, IntArray] = field(default_factory=dict)
    records: int = 0


def endurance(
    build: Build,
    pieces: Iterable[Mapping[str, FloatArray]],
    *,
    first: int = 0,
    every: int = 1,
    compared: Collection[str] = (),
    watched: int | None = None,
) -> Endurance:
    """Run the first estimator of a build over pieces of records (`sim.worlds.world.Streamed`).

    Parameters
    ----------
    pieces : iterable of mapping
        Columns (n,) by input name. There is no ``t``, so a ``dt`` is a column.
    first, every : int
        Of the records from ``first`` on each ``every`` is kept.
    compared : names of outputs
        Those that are compared with float64; none: float64 is not run.
    watched : int, optional
        Updates between two covariances whose eigenvalues are taken; None: none.

    Raises
    ------
    InputError
        See `InputReader.take` and `covariance_of`.
    """
    estimator, program = build.estimators[0], build.programs[0]
    level, reference = make_level("c", build), make_level("float", build) if compared else None
    covariance = None if watched is None else covariance_of(estimator)
    place = index_place("stream")
    reader = InputReader(estimator, lambda row, _, name: place(row, name))
    kept: list[dict[str, FloatArray]] = []
    flags = [o.name for o in estimator.outputs if o.unit == "bits"]
    found = Endurance(counts={n: np.zeros(_WORD, dtype=np.int64) for n in flags})
    square = dict.fromkeys(compared, 0.0)
    for piece in pieces:
        inputs, _ = reader.take_rows(piece)
        run, count = level.run(inputs), len(inputs)
        assert run.states is not None
        if covariance is not None and watched is not None:
            rows = {*range(watched - 1, count, watched), count - 1}
            p = covariance.of_words(program, run.states[sorted(rows)])
            least = float(np.linalg.eigvalsh(p).min())
            found.least_eigenvalue = min(found.least_eigenvalue, least)
        if reference is not None:
            beside = reference.run(inputs).outputs
            for d in differences(estimator.outputs, run.outputs, {n: beside[n] for n in compared}):
                square[d.output] += d.rms**2 * d.samples
                found.most[d.output] = max(found.most.get(d.output, 0.0), d.largest)
        for name in flags:
            bits = np.rint(run.outputs[name]).astype(np.int64)
            for k in range(int(bits.max()).bit_length()):
                found.counts[name][k] += np.count_nonzero(bits >> k & 1)
        found.saturated += run.n_saturated
        skipped = first - found.records
        rows_kept = slice(skipped if skipped >= 0 else skipped % every, None, every)
        kept.append({n: values[rows_kept].copy() for n, values in run.outputs.items()})
        found.records += count
    found.outputs = {n: np.concatenate([part[n] for part in kept]) for n in kept[0]}
    found.square = {n: total / found.records for n, total in square.items()}
    return found
