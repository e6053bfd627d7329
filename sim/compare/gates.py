"""Where the gates of a Kalman filter decide otherwise than in float64."""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.declarations import Output
from boresight.model.kalman.kalman import Kalman
from boresight.model.kalman.textbook import Textbook
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import Emitted
from boresight.sim.levels.level import Level

#: Output that counts what the gates reject.
_REJECTED = "rejected"
#: Largest share of updates that differ in which a gate is to blame, not what it compares.
_FEW = 0.01


def gates_apart(
    build: Build, number: int, pieces: Iterable[tuple[FloatArray, BoolArray]]
) -> tuple[int, str] | None:
    """The first update in which a filter's gates reject more or less than in float64, in words.

    None where they never do, or so often that they are not to blame.
    ``pieces`` are records (n, n_inputs), and which of them begin from the initial states, as their
    first ones do. The filter runs again in C, with an output that counts.
    """
    kalman = build.estimators[number]
    if not isinstance(kalman, Kalman):
        return None
    lines = [str(m.line) for m in Textbook(kalman).measurements if m.gate is not None]
    if not lines:
        return None
    counting = copy(kalman)
    names = [o.name for o in kalman.outputs]
    counting.outputs = (*kalman.outputs, *([] if _REJECTED in names else [Output(_REJECTED)]))
    again = Build(counting, word=build.word, params=[build.params[number]])
    levels: list[Level] = [Emitted(again), CompiledFloat(again)]
    first, step, apart, rows = "", 0, 0, 0
    for records, anew in pieces:
        for level in levels if len(anew) and anew[0] else ():
            level.reset()
        fixed, floating = (level.run(records).outputs[_REJECTED] for level in levels)
        differ = np.flatnonzero(np.rint(fixed) != np.rint(floating))
        if len(differ) and not apart:
            k = int(differ[0])
            step = rows + k
            first = f"{fixed[k]:.0f}, in float64 {floating[k]:.0f}"
        apart, rows = apart + len(differ), rows + len(records)
    if not 0 < apart <= _FEW * rows:
        return None
    wider = "use a wider word, or " * (build.word < 32)
    counts = [name for name in names if name in ("accepted", _REJECTED)] or [_REJECTED]
    shares = [f'Output("{name}", "bits", share={2.0 * apart / rows:.1g})' for name in counts]
    return step, (
        f"step {step}, measurements that the gate ({', '.join(dict.fromkeys(lines))}) rejects: "
        f"{first}; an innovation is within rounding of the gate; {wider}accept that some decisions "
        f"differ, by {' and '.join(shares)}"
    )
