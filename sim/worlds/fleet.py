"""Many draws of one closed loop at once, on the integer C: for figures over many seeds.

A `Fleet` is a world of many runs, whose values are arrays (runs,); `Single` makes the `World` of
one of them, which runs on every level, so that both tell the same story.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.firmware.many import ManyCModels
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, with_params
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program
from boresight.sim.levels.level import told
from boresight.sim.worlds.world import World

__all__ = ["Fleet", "Loops", "Single", "close_loops"]

FloatArray = npt.NDArray[np.float64]


class Fleet:
    """Base class of worlds of many runs; see `World`.

    Attributes
    ----------
    name : str
    runs : int
    """

    name: str = "fleet"
    runs: int

    def start(self) -> None:
        """Begin anew, every run."""
        raise NotImplementedError

    def record(self, outputs: Mapping[str, FloatArray] | None) -> Mapping[str, FloatArray] | None:
        """The next record of every run (runs,) by name, of the last outputs; None at the end.

        A value of one element is that of all runs.
        """
        raise NotImplementedError


class Single(World):
    """A fleet of one run as a world."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet

    def start(self) -> None:
        """Begin anew."""
        self.fleet.start()

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record; see `World`."""
        told = None if outputs is None else {n: np.array([v]) for n, v in outputs.items()}
        found = self.fleet.record(told)
        return None if found is None else {n: float(v[0]) for n, v in found.items()}


@dataclass(frozen=True, eq=False)
class Loops:
    """What happened between a fleet and the integer C.

    Attributes
    ----------
    inputs : float64 (n, runs, n_inputs)
        Records that the estimators saw, in the inputs' units.
    outputs : dict of str to float64 (n, runs)
        What they answered, in the outputs' units: those that were asked for.
    saturated : int (runs,)
        Updates in which an operation was clamped.
    """

    inputs: FloatArray
    outputs: dict[str, FloatArray]
    saturated: npt.NDArray[np.int64]


def close_loops(
    fleet: Fleet,
    estimator: Estimator,
    params: Mapping[str, float] | None = None,
    keep: Collection[str] | None = None,
) -> Loops:
    """Run every draw of a fleet until it ends.

    Parameters
    ----------
    keep : names, optional
        Outputs that are kept; by default all.

    Raises
    ------
    InputError
        The fleet gives no record at all, or one that the estimator cannot take.
    """
    program = with_params(estimator.compile(), estimator, params)
    models = ManyCModels(program, fleet.runs)
    taken, given_out = _Taken(estimator, fleet), _formats(program, program.outputs)
    words_in, names = _formats(program, program.inputs), program.output_names
    kept = [k for k, n in enumerate(names) if keep is None or n in keep]
    inputs: list[FloatArray] = []
    answers: list[npt.NDArray[np.int32]] = []
    saturated = np.zeros(fleet.runs, dtype=np.int64)
    outputs: dict[str, FloatArray] | None = None
    fleet.start()
    while (given := fleet.record(outputs)) is not None:
        record = taken.of(given)
        found, clamped = models.update(words_in.quantise(record).astype(np.int32))
        saturated += clamped
        outputs = told(dict(zip(names, given_out.real(found).T, strict=True)), program.ports)
        inputs.append(record)
        answers.append(found[:, kept])
    if not inputs:
        raise InputError.at(
            f"fleet {fleet.name}",
            wanted="at least one record",
            found="none",
            fix="let record() return None only at the end",
        )
    real = _formats(program, [program.outputs[k] for k in kept]).real
    table = real(np.stack(answers))
    by_name = {names[k]: table[:, :, at] for at, k in enumerate(kept)}
    ports = [port for port in program.ports if port.name in by_name]
    return Loops(np.stack(inputs), told(by_name, ports), saturated)


def _formats(program: Program, numbers: Sequence[int]) -> Format:
    """The formats of several values as one, for arrays whose last axis they are."""
    frac = np.array([program.format(number).frac for number in numbers])
    return Format(program.arithmetic.word, frac)  # type: ignore[arg-type]


class _Taken:
    """Records of a fleet as inputs, as `Intake` takes those of one run."""

    def __init__(self, estimator: Estimator, fleet: Fleet) -> None:
        self.inputs, self.fleet = estimator.inputs, fleet
        self.low = np.array([i.low for i in self.inputs])
        self.high = np.array([i.high for i in self.inputs])
        self.clamped = np.array([i.clamp for i in self.inputs])
        self.last = np.full((fleet.runs, len(self.inputs)), np.nan)

    def of(self, given: Mapping[str, FloatArray]) -> FloatArray:
        """Inputs (runs, n_inputs)."""
        record = np.empty_like(self.last)
        for k, declared in enumerate(self.inputs):
            if declared.flags:
                record[:, k] = ~np.isnan([given[n] for n in declared.flags]).any(axis=0)
            elif declared.name in given:
                record[:, k] = given[declared.name]
            else:
                raise self._error(k, "none")
        for k in np.flatnonzero(np.isnan(record).any(axis=0)).tolist():
            gone, rule = np.isnan(record[:, k]), self.inputs[k].missing
            record[gone, k] = (
                self.last[gone, k] if rule == "hold" else np.nan if rule is None else rule
            )
        inside: FloatArray = np.minimum(np.maximum(record, self.low), self.high)
        wrong = ~((record == inside) | self.clamped & ~np.isnan(record)).all(axis=0)
        if wrong.any():
            k = int(np.argmax(wrong))
            raise self._error(k, repr(float(record[record[:, k] != inside[:, k], k][0])))
        self.last = inside
        return inside

    def _error(self, k: int, found: str) -> InputError:
        declared = self.inputs[k]
        return InputError.at(
            f"fleet {self.fleet.name}, input {declared.name}",
            wanted=f"{declared.low:g} to {declared.high:g} {declared.unit}".rstrip(),
            found=found,
            fix="correct the fleet's record",
        )
