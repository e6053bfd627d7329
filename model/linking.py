"""Inputs that another program of the same core gives: `Input.source`.

In a core that holds both, the reader takes the word where the other program keeps it
(`gateware.schedule.links`). Everywhere else its records hold that word, as `held` says: so every
level computes the same, whether or not it knows of links.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import Given
from boresight.model.errors import InputError, closest
from boresight.model.estimator import Estimator
from boresight.model.places import placed
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program

__all__ = ["first_word", "held", "linked_estimators"]


def linked_estimators(estimators: Sequence[Estimator], *, word: int = 32) -> list[Estimator]:
    """The estimators of one core, with linked inputs in the format of what they read.

    Parameters
    ----------
    estimators : sequence of Estimator
        In the order of their numbers; those without links are returned as they are.
    word : int
        W.

    Raises
    ------
    InputError
        A source that its program does not give, has another unit, or lies beyond the input's
        range; programs that read each other; no input left that comes with the record.
    """
    made = {e.name: e for e in estimators}
    programs: dict[str, Program] = {}
    at_work: list[str] = []

    def program_of(name: str) -> Program:
        if name in at_work:
            raise InputError.at(
                f"estimator {name}",
                wanted="programs that do not wait for each other's words",
                found=" reads ".join([*at_work[at_work.index(name) :], name]),
                fix="feed one of them with the record",
            )
        if name not in programs:
            at_work.append(name)
            made[name] = _fed(made[name], program_of, made.keys(), word)
            programs[name] = made[name].compile(word=word)
            at_work.pop()
        return programs[name]

    for estimator in estimators:
        if any(i.source.partition(".")[0] in made for i in estimator.inputs):
            program_of(estimator.name)
    return [made[e.name] for e in estimators]


def _fed(
    estimator: Estimator, program_of: Callable[[str], Program], names: Collection[str], word: int
) -> Estimator:
    """``estimator`` with the formats of its sources in its inputs."""
    where = f"estimator {estimator.name}"
    if not any(i.source.partition(".")[0] in names for i in estimator.inputs):
        return estimator
    inputs = []
    for declared in estimator.inputs:
        name, _, output = declared.source.partition(".")
        if name not in names:
            inputs.append(declared)
            continue
        program = program_of(name)
        if output not in program.output_names:
            raise InputError.at(
                placed(declared.line, f"{where}, input {declared.name}"),
                wanted=f"an output of {name}: {', '.join(closest(output, program.output_names))}",
                found=repr(output),
                fix="correct its source",
            )
        value = program.values[program.outputs[program.output_names.index(output)]]
        unit = {port.name: port.unit for port in program.ports}.get(output, value.unit)
        given = Given(value.frac, value.low, value.high)
        inputs.append(declared.taking(given, word, of=declared.source, unit=unit, where=where))
    if all(i.source.partition(".")[0] in names for i in inputs):
        raise InputError.at(
            where,
            wanted="an input that comes with the record and so begins the update",
            found="only inputs of other programs",
            fix="add one, for example the time step dt",
        )
    fed = copy.copy(estimator)
    fed.inputs = tuple(inputs)
    return fed


def first_word(program: Program, output: str) -> int:
    """The word that a reader of ``output`` sees before the program's first update."""
    number = program.outputs[program.output_names.index(output)]
    value = program.values[number]
    first = next((port.first for port in program.ports if port.name == output), 0.0)
    return int(program.format(number).quantise(min(max(first, value.low), value.high)))


def held(words: npt.NDArray[Any], done: IntArray, first: float) -> npt.NDArray[Any]:
    """What each update of a reader sees of an output.

    Parameters
    ----------
    words : (n,)
        The output's words, or values, after each update of the program that gives it.
    done : int (m,)
        How many of those were complete when each of the reader's updates began.
    first : number
        What there is before the first one (`first_word`).

    Returns
    -------
    (m,)
    """
    return np.concatenate([[first], words])[done]
