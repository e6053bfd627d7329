"""Relations of the programs of a core: words that they read, states that they share.

Linked inputs (`Input.source`) read an output of another program. In a core with both programs, the
reader reads the word in the register of the other program (`gateware.schedule.links`). Everywhere
else its records contain that word (`linked_words`), so all levels compute the same.

An estimator that `shares` the states of another one updates those, in a core with both: each update
of either begins with the states of the last complete update of both. Elsewhere it has its own.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Sequence
from itertools import zip_longest
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import SourceFormat
from boresight.model.errors import InputError, listed
from boresight.model.estimator import Estimator
from boresight.model.places import placed
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program

__all__ = ["families", "first_word", "linked_words", "linked_estimators"]


class _Sharing(Protocol):
    """An estimator or program."""

    @property
    def name(self) -> str: ...
    @property
    def shares(self) -> str: ...


def families(programs: Sequence[_Sharing]) -> tuple[int, ...]:
    """For each estimator or program of a core, the number of the one whose states it updates."""
    numbers = {program.name: k for k, program in enumerate(programs)}
    return tuple(numbers.get(program.shares, k) for k, program in enumerate(programs))


def linked_estimators(estimators: Sequence[Estimator], *, word: int = 32) -> list[Estimator]:
    """Return the estimators of one core, with linked inputs in the format of their sources.

    Parameters
    ----------
    estimators : sequence of Estimator
        In the order of their numbers; those without links are returned unchanged.
    word : int
        W.

    Raises
    ------
    InputError
        A source that is not an output of its program, has another unit, or exceeds the input's
        range; programs that read each other; an estimator without an input from the record; shared
        states that differ, or are read by a third program.
    """
    for estimator, family in zip(estimators, families(estimators), strict=True):
        if estimator is not estimators[family]:
            _check_shared(estimator, estimators[family], estimators)
    linked = {e.name: e for e in estimators}
    programs: dict[str, Program] = {}
    in_progress: list[str] = []

    def program_of(name: str) -> Program:
        if name in in_progress:
            raise InputError.at(
                f"estimator {name}",
                wanted="programs that do not wait for each other's words",
                found=" reads ".join([*in_progress[in_progress.index(name) :], name]),
                fix="feed one of them with the record",
            )
        if name not in programs:
            in_progress.append(name)
            linked[name] = _with_sources(linked[name], program_of, linked.keys(), word)
            programs[name] = linked[name].compile(word=word)
            in_progress.pop()
        return programs[name]

    for estimator in estimators:
        if any(i.source.partition(".")[0] in linked for i in estimator.inputs):
            program_of(estimator.name)
    return [linked[e.name] for e in estimators]


def _check_shared(estimator: Estimator, owner: Estimator, estimators: Sequence[Estimator]) -> None:
    """Refuse to share states that are not the same, or that another estimator reads."""
    where = f"estimator {estimator.name}"
    if families(estimators)[estimators.index(owner)] != estimators.index(owner):
        raise InputError.at(
            where,
            wanted="the estimator that has the states, which shares no other's",
            found=f"shares = {estimator.shares!r}",
            fix="name that one in all others",
        )
    for state, owner_state in zip_longest(estimator.states, owner.states):
        if state != owner_state:
            raise InputError.at(
                placed(getattr(state or owner_state, "line", ""), where),
                wanted=f"the states of {owner.name}: {owner_state or 'no more'}",
                found=f"{state or 'no more'}",
                fix="declare them once, for both",
            )
    if estimator.profile is not owner.profile:
        raise InputError.at(
            where,
            wanted=f"states in the formats of those of {owner.name}",
            found="ranges of a profile for one of the two",
            fix="compile both without a profile",
        )
    pair = {estimator.name, owner.name}
    for reader in estimators:
        for declared in reader.inputs:
            name = declared.source.partition(".")[0]
            linked = name in {e.name for e in estimators}
            if linked and (name in pair or reader.name in pair):
                raise InputError.at(
                    placed(declared.line, f"estimator {reader.name}, input {declared.name}"),
                    wanted="no link to or from programs that share states",
                    found=f"source = {declared.source!r}",
                    fix="feed it with the record",
                )


def _with_sources(
    estimator: Estimator, program_of: Callable[[str], Program], names: Collection[str], word: int
) -> Estimator:
    """Return the estimator with the formats of its sources in its inputs."""
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
                wanted=f"an output of {name}: {listed(output, program.output_names)}",
                found=repr(output),
                fix="correct its source",
            )
        value = program.values[program.outputs[program.output_names.index(output)]]
        unit = {port.name: port.unit for port in program.ports}.get(output, value.unit)
        words = SourceFormat(value.frac, value.low, value.high)
        inputs.append(declared.with_source(words, word, of=declared.source, unit=unit, where=where))
    if all(i.source.partition(".")[0] in names for i in inputs):
        raise InputError.at(
            where,
            wanted="an input that comes with the record and so begins the update",
            found="only inputs of other programs",
            fix="add one, for example the time step dt",
        )
    linked = copy.copy(estimator)
    linked.inputs = tuple(inputs)
    return linked


def first_word(program: Program, output: str) -> int:
    """Word that a reader of ``output`` reads before the program's first update."""
    number = program.outputs[program.output_names.index(output)]
    value = program.values[number]
    first = next((port.first for port in program.ports if port.name == output), 0.0)
    return int(program.format(number).quantise(min(max(first, value.low), value.high)))


def linked_words(words: npt.NDArray[Any], done: IntArray, first: float) -> npt.NDArray[Any]:
    """Word of an output that each update of its reader reads.

    Parameters
    ----------
    words : (n,)
        The output's words, or values, after each update of the program that gives it.
    done : int (m,)
        Number of those updates complete when each of the reader's updates began.
    first : number
        Word before the first update (`first_word`).

    Returns
    -------
    (m,)
    """
    return np.concatenate([[first], words])[done]
