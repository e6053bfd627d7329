"""Types of arrays by their elements, and a test of samples for repetition."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Held samples: least share that repeat the one before, and that jump after it; finest steps that
#: are a jump; least number of jumps, and of values; scatter of times that are equal.
_REPEATED, _HELD, _JUMP, _OFTEN, _LEVELS, _EVEN = 0.2, 0.03, 5.0, 10, 20, 0.2
#: Share of the repeats with a change after them.
_SINGLE = 0.9
#: The same of a short log: least number of jumps, and largest of them in the finest step.
_FEW, _VARIED = 3, 1.5


def is_held(values: FloatArray, *, few: bool = False) -> bool:
    """Whether samples (n, axes) repeat the one before, often or for equal times, and then jump.

    Values that are equal because they are coarse, or at rest, do not jump. ``few``: three different
    jumps after equal times are enough.
    """
    if len(values) < 3:
        return False
    steps = np.abs(np.diff(values, axis=0))
    finest = min(steps[steps > 1e-6 * np.abs(values).max()], default=0.0)
    changed = (steps != 0.0).any(axis=1)
    jumps = steps.max(axis=1) > _JUMP * finest
    held = ~changed[:-1] & jumps[1:]
    runs = np.diff(np.flatnonzero(changed))
    is_even = runs.size > 0 and runs.std() < _EVEN * runs.mean()
    if few and len(runs) + 1 >= _FEW and is_even and runs.min() > 1:
        return bool(steps.max() > _VARIED * finest)
    levels = len(np.unique(values[1:][changed], axis=0))  # of a command they are few
    if 1.0 - changed.mean() < _REPEATED or held.sum() < _OFTEN:
        return False
    is_even = is_even and jumps[changed].mean() > 0.5
    # Coarse values near rest repeat in rows, or change by one step.
    is_single = changed[1:][~changed[:-1]].mean() > _SINGLE
    is_single = is_single and np.median(steps.max(axis=1)[changed]) > 2.0 * finest
    is_seen = held.mean() > _HELD or is_even or is_single
    return bool(levels > min(_LEVELS, changed.sum() // 2) and is_seen)
