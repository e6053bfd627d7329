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

from boresight.firmware.build import CModel
from boresight.model.words.fixed import IntArray
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import outputs_of
from boresight.sim.levels.stream import fed

__all__ = ["Endurance", "endurance"]

FloatArray = npt.NDArray[np.float64]
_WORD = 32  #: bits of an output ``bits`` that are counted.


@dataclass(eq=False)
class Endurance:
    """What a long run gave.

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
    first, every : int
        Of the records from ``first`` on each ``every`` is kept.
    compared : names of outputs
        Those that are compared with float64; none: float64 is not run.
    watched : int, optional
        Updates between two covariances whose eigenvalues are taken; None: none.

    Raises
    ------
    InputError
        See `fed` and `covariance_of`.
    """
    estimator, program = build.estimators[0], build.programs[0]
    model, reference = CModel(program), CompiledFloat(build) if compared else None
    covariance = None if watched is None else covariance_of(estimator)
    kept: list[IntArray] = []
    flags = [o.name for o in estimator.outputs if o.unit == "bits"]
    found = Endurance(counts={n: np.zeros(_WORD, dtype=np.int64) for n in flags})
    square = dict.fromkeys(compared, 0.0)
    for inputs in fed(estimator, pieces):
        words, saturated, states = _updates(model, words_of(program, inputs), watched)
        outputs = outputs_of(program, words)
        if covariance is not None:
            least = np.linalg.eigvalsh(covariance.of_words(program, states)).min()
            found.least_eigenvalue = min(found.least_eigenvalue, float(least))
        if reference is not None:
            beside = reference.run(inputs).outputs
            for d in differences(estimator.outputs, outputs, {n: beside[n] for n in compared}):
                square[d.output] += d.rms**2 * d.samples
                found.most[d.output] = max(found.most.get(d.output, 0.0), d.largest)
        for name in flags:
            bits = np.rint(outputs[name]).astype(np.int64)
            for k in range(int(bits.max()).bit_length()):
                found.counts[name][k] += np.count_nonzero(bits >> k & 1)
        found.saturated += int(saturated.sum())
        skipped = first - found.records
        kept.append(words[skipped if skipped >= 0 else skipped % every :: every])
        found.records += len(inputs)
    found.outputs = outputs_of(program, np.concatenate(kept))
    found.square = {n: total / found.records for n, total in square.items()}
    return found


def _updates(
    model: CModel, words: IntArray, every: int | None
) -> tuple[IntArray, npt.NDArray[np.bool_], IntArray]:
    """Outputs and saturations of all updates, states after each ``every`` and after the last."""
    parts, states = [], []
    step = every or len(words)
    for begin in range(0, len(words), step):
        some = words[begin : begin + step]
        parts.append(model.update(some[:-1]))
        out, clamped, after = model.trajectory(some[-1:])
        parts.append((out, clamped))
        states.append(after)
    outputs, saturated = (np.concatenate(part) for part in zip(*parts, strict=True))
    return outputs, saturated, np.concatenate(states)
