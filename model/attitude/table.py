"""Parameters of an estimator, written as a table."""

from __future__ import annotations

import inspect

from boresight.model.estimator import Param


def params_of(text: str) -> tuple[Param, ...]:
    """Parameters from lines ``name default low high unit``, with "-" for a unit of none.

    The meaning stands below each of these lines, indented.
    """
    params: list[Param] = []
    meaning: list[str] = []
    for line in reversed(inspect.cleandoc(text).splitlines()):
        if line.startswith(" "):
            meaning.insert(0, line.strip())
            continue
        name, default, low, high, unit = line.split()
        numbers = (float(default), float(low), float(high))
        params.insert(0, Param(name, *numbers, unit.strip("-"), " ".join(meaning)))
        meaning.clear()
    return tuple(params)
