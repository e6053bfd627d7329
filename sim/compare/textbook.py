"""Float64 beside a second form of the same equations, where an estimator has one."""

from __future__ import annotations

from collections.abc import Sequence

from boresight.model.arrays import FloatArray
from boresight.model.estimator import SecondForm
from boresight.model.methods import called
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Run

__all__ = ["beside_textbook", "textbook_line"]

#: Leading updates that are compared: the second form is slow.
_MOST = 2000


def beside_textbook(
    build: Build, number: int, records: FloatArray, floating: Run
) -> tuple[tuple[Difference, ...], tuple[str, ...]]:
    """Differences of float64 from `Estimator.textbook`, and its remarks; none without it."""
    estimator, some = build.estimators[number], records[:_MOST]
    book = called(
        estimator.textbook,
        some,
        build.params[number],
        where=f"estimator {estimator.name}, textbook",
        wanted="a second form or None",
        kind=SecondForm | None,
        answer="return SecondForm(outputs={NAME: ARRAY})",
    )
    if book is None:
        return (), ()
    outputs = {name: values[: len(some)] for name, values in floating.outputs.items()}
    return tuple(differences(estimator.outputs, outputs, book.outputs)), tuple(book.remarks)


def textbook_line(errors: Sequence[Difference]) -> str:
    """One line for people."""
    unit = [f" {d.unit}" if d.unit else "" for d in errors]
    texts = ", ".join(f"{d.output} {d.largest:.1e}{u}" for d, u in zip(errors, unit, strict=True))
    beyond = [d.output for d in errors if not d.good]
    verdict = f"BEYOND the tolerance of {', '.join(beyond)}" if beyond else "within"
    return f"float64 against the textbook, {errors[0].samples} updates: {texts}: {verdict}"
