"""The same estimator on the same log in words of other widths: how many bits its outputs need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.compare.difference import Differences
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import Emitted

__all__ = ["WIDTHS", "width_section"]

#: Every other width that programs may have.
WIDTHS = (18, 20, 22, 24, 26, 28, 30, 32)


def width_section(
    check: CheckResult,
    widths: Sequence[int] = WIDTHS,
    *,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Errors of each output against float64 over the width, on the C model.

    Parameters
    ----------
    check : CheckResult
        Of a build of one estimator; its float run does not depend on the width.

    Returns
    -------
    dict
        ``points``: for each width its ``outputs`` (see `sim.compare.difference`), the updates that
        saturated, whether all is ``good``, and an ``error`` where it does not compile.
        ``least_good``: the smallest width from which on all of them are; null if none is.
    """
    points = []
    for width in widths:
        progress(f"W = {width}")
        points.append({"word": width, **_point(check, width)})
    smallest = None
    for point in sorted(points, key=lambda p: -int(p["word"])):
        if not point["good"]:
            break
        smallest = point["word"]
    return {"dataset": check.given.record.name, "points": points, "least_good": smallest}


def _point(check: CheckResult, width: int) -> dict[str, Any]:
    """One width."""
    build = Build(*check.build.estimators, word=width, params=check.build.params)
    try:
        level, saturated = Emitted(build), 0
    except InputError as error:
        return {"good": False, "error": str(error), "saturated_updates": None, "outputs": []}
    outputs = build.estimators[0].outputs
    differences = Differences(outputs, [o.name for o in outputs])
    for columns, _, floating in check.parts():
        run = level.run(columns.inputs)
        saturated += run.n_saturated
        differences.add(run.outputs, floating.outputs)
    errors = differences.result()
    return {
        "good": not saturated and all(d.good for d in errors),
        "error": "",
        "saturated_updates": saturated,
        "outputs": [d.to_json() for d in errors],
    }
