"""Types of arrays, by what they hold; and whether samples are held."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Held samples: least share that repeat the one before, and that jump after it; finest steps that
#: are a jump; least number of jumps, and of values; scatter of times that are equal.
_REPEATED, _HELD, _JUMP, _OFTEN, _LEVELS, _EVEN = 0.2, 0.03, 5.0, 10, 20, 0.2


def is_held(values: FloatArray) -> bool:
    """Whether samples (n, axes) repeat the one before, often or for equal times, and then jump.

    Values that are equal because they are coarse, or at rest, do not jump.
    """
    if len(values) < 3:
        return False
    steps = np.abs(np.diff(values, axis=0))
    finest = min(steps[steps > 1e-6 * np.abs(values).max()], default=0.0)
    changed = (steps != 0.0).any(axis=1)
    jumps = steps.max(axis=1) > _JUMP * finest
    held = ~changed[:-1] & jumps[1:]
    runs = np.diff(np.flatnonzero(changed))
    levels = len(np.unique(values[1:][changed], axis=0))  # of a command they are few
    if 1.0 - changed.mean() < _REPEATED or held.sum() < _OFTEN:
        return False
    is_even = runs.std() < _EVEN * runs.mean() and jumps[changed].mean() > 0.5
    return bool(levels > min(_LEVELS, changed.sum() // 2) and (held.mean() > _HELD or is_even))
