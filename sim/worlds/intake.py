"""One record of a world as an estimator's inputs, checked sample by sample."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator

__all__ = ["Intake"]


class Intake:
    """Turns a world's records into input vectors, as `sim.records.feed` does with a log's.

    Parameters
    ----------
    estimator : Estimator
    where : str
        World, for messages.

    Attributes
    ----------
    clamped : dict of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    new : bool (n_inputs,)
        Whether the last record had a new sample there.
    """

    def __init__(self, estimator: Estimator, where: str) -> None:
        self.estimator, self.where = estimator, where
        self.clamped: dict[str, int] = {}
        self.new: npt.NDArray[np.bool_] = np.zeros(len(estimator.inputs), dtype=np.bool_)
        self._held: dict[str, float] = {}
        self._steps = 0

    def take(self, record: Mapping[str, float]) -> npt.NDArray[np.float64]:
        """Inputs (n_inputs,) of one record.

        Raises
        ------
        InputError
            An input is not there, is no finite number, is missing where it may not be, or lies
            outside its declared range.
        """
        values, new = [], {}
        for declared in self.estimator.inputs:
            if declared.flags:
                values.append(0.0)
                continue
            if declared.name not in record:
                wanted = f"a value for every input of {self.estimator.name}"
                raise self._error(declared.name, wanted, "none")
            value = self.number(declared.name, record[declared.name])
            new[declared.name] = not math.isnan(value)
            if math.isnan(value):
                value = self._missing(declared.name, declared.missing)
            self._held[declared.name] = value
            inside = min(max(value, declared.low), declared.high)
            if inside != value:
                if not declared.clamp:
                    raise self._error(
                        declared.name,
                        f"{declared.low:g} to {declared.high:g} {declared.unit}".rstrip(),
                        f"{value:.6g}",
                    )
                self.clamped[declared.name] = self.clamped.get(declared.name, 0) + 1
            values.append(inside)
        for k, declared in enumerate(self.estimator.inputs):
            if declared.flags:
                valid = all(new[name] for name in declared.flags)
                values[k] = min(max(float(valid), declared.low), declared.high)
                new[declared.name] = valid
        self.new = np.array([new[i.name] for i in self.estimator.inputs])
        self._steps += 1
        return np.array(values)

    def number(self, name: str, given: object) -> float:
        """A value of the next record as a number, NaN if there is none.

        Raises
        ------
        InputError
            It is no number, or infinite.
        """
        try:
            value = float(given)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise self._error(name, "a number", type(given).__name__) from None
        if math.isinf(value):
            raise self._error(name, "a finite number", "an infinite one")
        return value

    def _missing(self, name: str, rule: float | str | None) -> float:
        if rule == "hold" and name in self._held:
            return self._held[name]
        if rule is None or isinstance(rule, str):
            raise self._error(name, "a number", "no value")
        return rule

    def _error(self, name: str, wanted: str, found: str) -> InputError:
        return InputError.at(
            f"{self.where}, step {self._steps}, {name}",
            wanted=wanted,
            found=found,
            fix="correct the record that the world returns",
        )
