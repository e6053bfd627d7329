"""Outputs beside the true values of a log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import Output
from boresight.sim.compare.difference import Difference, Differences
from boresight.sim.records.feed import Feed

__all__ = ["TrueError", "TrueErrors"]


@dataclass(frozen=True)
class TrueError:
    """Error of one output against truth.

    Attributes
    ----------
    difference : Difference
    limit : float or None
        Largest accepted root mean square (`Output.truth`).
    """

    difference: Difference
    limit: float | None

    @property
    def good(self) -> bool:
        """Not judged, or within the limit."""
        return self.limit is None or self.difference.rms <= self.limit

    def line(self) -> str:
        """One line for people."""
        d = self.difference
        unit = f" {d.unit}" if d.unit else ""
        verdict = "not judged"
        if self.limit is not None:
            verdict = f"{'within' if self.good else 'BEYOND'} {self.limit:.3g}"
        return f"{d.output:12s} rms {d.rms:.3g}{unit}, max {d.largest:.3g}{unit}: {verdict}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {**self.difference.to_json(), "tolerance": self.limit, "good": self.good}


class TrueErrors:
    """Errors of a run against the true values of its log, piece by piece."""

    def __init__(self, outputs: Sequence[Output]) -> None:
        self._outputs = outputs
        self._limits = {o.name: o.truth for o in outputs}
        self._errors: Differences | None = None

    def add(self, columns: Feed, outputs: Mapping[str, FloatArray]) -> None:
        """Take the next rows: those that do not count (``mov``) are left out."""
        names = [o.name for o in self._outputs if o.name in columns.truth]
        if not names:
            return
        self._errors = self._errors or Differences(self._outputs, names, judged=False)
        truth = {n: np.where(columns.counts, columns.truth[n], np.nan) for n in names}
        self._errors.add(outputs, truth)

    def result(self) -> tuple[TrueError, ...]:
        """One for each output with true values, and the attitude."""
        made = () if self._errors is None else self._errors.result()
        return tuple(TrueError(d, self._limits.get(d.output)) for d in made if d.samples)
