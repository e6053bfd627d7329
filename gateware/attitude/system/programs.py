"""The core of a complete system: estimators, and the programs before them."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

from boresight.gateware.attitude.system.plan import FRONT_NAMES, MOST_REGISTERS, SYSTEM_WORDS
from boresight.gateware.core import Core, build_shared_core
from boresight.model.attitude.front import FRONT
from boresight.model.attitude.front.sensed import SENSED, Sensed, board_params
from boresight.model.declarations import Input, SourceFormat
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator, with_params
from boresight.model.resolve import Named, estimator_of
from boresight.model.words.fixed import Format

#: Most words of a record on a board, and most estimators.
_MOST_WORDS, _MOST = 16, 8


def system_estimators(filters: Sequence[Named], *, word: int = 32) -> list[Estimator]:
    """Estimators, then the programs before them: in the order of their numbers in the core.

    Inputs with a sensor, by name, have the format of its words; inputs of one name without a sensor
    share a register.

    Raises
    ------
    InputError
        Unknown name; an input whose unit is not the sensor's, whose range does not hold the
        sensor's, or that does not say what it reads between two samples; too many words.
    """
    chosen = [estimator_of(f) for f in filters]
    front = [FRONT[name]() for name in FRONT_NAMES]
    if len(chosen) > _MOST:
        raise InputError.at(
            "estimators",
            wanted=f"{_MOST} or fewer on a board",
            found=str(len(chosen)),
            fix="leave some out",
        )
    formats: dict[str, int] = {}
    for program in (e.compile(word=word) for e in front):
        outputs = zip(program.output_names, program.outputs, strict=True)
        formats |= {name: program.format(n).frac for name, n in outputs}
    registers: dict[str, Input] = {}
    fed = [_fed(e, formats, registers, word) for e in chosen]
    if len(registers) > MOST_REGISTERS:
        raise InputError.at(
            "estimators",
            wanted=f"{MOST_REGISTERS} or fewer inputs without a sensor",
            found=f"{len(registers)}: {', '.join(registers)}",
            fix="give them fewer, or the names of what the sensors give",
        )
    return [*fed, *front]


def _fed(
    estimator: Estimator, formats: Mapping[str, int], registers: dict[str, Input], word: int
) -> Estimator:
    """The estimator with its inputs in the formats that they come in."""
    where = f"estimator {estimator.name}"
    inputs = []
    for i in estimator.inputs:
        if i.flags:
            inputs.append(i)
        elif i.name in SENSED:
            inputs.append(_sensed(i, SENSED[i.name], formats[i.name], word, where))
        else:
            first = registers.setdefault(i.name, i)
            form = Format.declared(word, first.low, first.high, first.unit)
            words = SourceFormat(form.frac, first.low, first.high)
            source = f"the input register {i.name}"
            inputs.append(i.with_source(words, word, of=source, unit=first.unit, where=where))
    for kind, count in (("inputs", len(inputs)), ("outputs", len(estimator.outputs))):
        if count > _MOST_WORDS:
            raise InputError.at(
                where,
                wanted=f"{_MOST_WORDS} or fewer {kind} on a board",
                found=str(count),
                fix="pack them, or say --top records",
            )
    fed = copy.copy(estimator)
    fed.inputs = tuple(inputs)
    return fed


def _sensed(i: Input, sensor: Sensed, frac: int, word: int, where: str) -> Input:
    """An input with the words of a sensor."""
    if not sensor.always and i.missing is None:
        raise InputError.at(
            f"{where}, input {i.name}",
            wanted="what it reads between two lines of the compass",
            found="neither missing=NUMBER nor missing='hold'",
            fix="declare it",
        )
    # A time step below the range asks for a restart, one above it comes after a gap.
    clamped = replace(i, clamp=True) if i.name == "dt" else i
    words = SourceFormat(frac, sensor.low, sensor.high)
    sensed = clamped.with_source(words, word, of="the sensor", unit=sensor.unit, where=where)
    return i if sensed is clamped else sensed


def system_core(
    filters: Sequence[Named],
    *,
    config: str = "small",
    word: int = 32,
    clock_hz: float = 100e6,
    params: Mapping[str, Mapping[str, float]] | None = None,
) -> Core:
    """Compile the core of a system. Estimator k is program k; the front programs follow.

    Parameters
    ----------
    filters : sequence of str, class or Estimator
        Estimators of any inputs and outputs.
    config : str
        "small" or "fast", or with more registers "small-1024", "fast-2048" and so on.
    clock_hz : float
        Clock of the system, Hz: time stamps count its cycles (``tick_s``).
    params : mapping, optional
        By program's name, the parameter values other than the defaults.

    Raises
    ------
    InputError
        See `system_estimators`; unknown name of a program with parameters, of a parameter or
        configuration; a word below 26 bits.
    ScheduleError
        The programs do not fit the machine.
    """
    if word not in SYSTEM_WORDS:
        raise InputError.at(
            "word",
            wanted=f"{SYSTEM_WORDS[0]} to {SYSTEM_WORDS[-1]} bits for a complete system",
            found=str(word),
            fix="choose a width inside the range",
        )
    estimators = system_estimators(filters, word=word)
    for name in params or {}:
        require_choice(
            f"parameters of {name}",
            name,
            (e.name for e in estimators),
            "leave them out, or add the filter",
        )
    values = {"calibrate_inertial": {"tick_s": 1.0 / clock_hz}}
    for e in estimators:
        values[e.name] = {**values.get(e.name, {}), **board_params(e.params)}
    for name, overrides in (params or {}).items():
        values[name] = {**values.get(name, {}), **overrides}
    programs = [with_params(e.compile(word=word), e, values.get(e.name)) for e in estimators]
    return build_shared_core(programs, config)
