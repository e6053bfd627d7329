"""Which program of the system's core does what, and in which formats: what the conductor is told.

The core of a complete system holds the filters, then the three programs of `model.front`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from boresight.gateware.schedule.slots import Schedule
from boresight.model.words.program import Program

__all__ = ["FRONT_NAMES", "RAW", "RECORD", "Plan", "plan_of"]

#: The programs before the filters, in the order of their numbers, which follow the filters'.
FRONT_NAMES = ("calibrate_inertial", "calibrate_field", "compass_field")
#: Words of a filter's input record.
RECORD = ("dt", "gx", "gy", "gz", "mx", "my", "mz", "ax", "ay", "az")
_INERTIAL = (*(name for name in RECORD if name[0] in "ga"), "dt")
_FIELD = tuple(name for name in RECORD if name[0] == "m")
#: Raw words of an inertial sample.
RAW = (*(f"{name}_counts" for name in _INERTIAL[:-1]), "stamp", "restart")


@dataclass(frozen=True)
class Plan:
    """The programs of a core as the conductor sees them.

    Attributes
    ----------
    word : int
        W.
    names : tuple of str
        Names of the programs, by number.
    filters : int
        How many of them, the first ones, are filters.
    lengths : tuple of int
        Cycles of each.
    outputs : int
        Words of a filter's output record.
    count_bits : int
        Fraction bits of raw counts in the input words.
    """

    word: int
    names: tuple[str, ...]
    filters: int
    lengths: tuple[int, ...]
    outputs: int
    count_bits: int

    @property
    def inertial(self) -> int:
        """Number of `calibrate_inertial`."""
        return self.filters

    @property
    def field(self) -> int:
        """Number of `calibrate_field`."""
        return self.filters + 1

    @property
    def compass(self) -> int:
        """Number of `compass_field`."""
        return self.filters + 2


def plan_of(programs: Sequence[Program], schedules: Sequence[Schedule]) -> Plan:
    """The plan of a system's core: filters first, then `FRONT_NAMES`.

    Parameters
    ----------
    programs : sequence of Program
        By number.
    schedules : sequence of Schedule
        What was made of them.

    Raises
    ------
    ValueError
        The programs are not such, or their words do not fit together: the front programs' outputs
        must have the binary points of every filter's inputs. Or a program gives out a word before
        it has taken the last one of its record.
    """
    filters = len(programs) - len(FRONT_NAMES)
    names = tuple(p.name for p in programs)
    if filters < 1 or names[filters:] != FRONT_NAMES:
        raise ValueError(f"programs must be filters, then {', '.join(FRONT_NAMES)}, not {names}")
    front = programs[filters:]
    given = {
        name: front[k].format(n)
        for k in (0, 1)
        for name, n in zip(front[k].output_names, front[k].outputs, strict=True)
    }
    given_by_compass = {
        name: front[2].format(n)
        for name, n in zip(front[2].output_names, front[2].outputs, strict=True)
    }
    for program, inputs, outputs in zip(
        front,
        (RAW, tuple(f"{n}_counts" for n in _FIELD), None),
        (_INERTIAL, _FIELD, _FIELD),
        strict=True,
    ):
        if program.output_names != outputs:
            raise ValueError(
                f"{program.name} must have the outputs {outputs}, not {program.output_names}"
            )
        if inputs is not None and _input_names(program) != inputs:
            raise ValueError(
                f"{program.name} must have the inputs {inputs}, not {_input_names(program)}"
            )
    for program in programs[:filters]:
        if _input_names(program) != RECORD:
            raise ValueError(
                f"{program.name} must have the inputs {RECORD}, not {_input_names(program)}"
            )
        if program.output_names != programs[0].output_names:
            raise ValueError(
                f"{program.name} must have the outputs of {names[0]}, not {program.output_names}"
            )
        for name, number in zip(RECORD, program.inputs, strict=True):
            for have in (given[name], given_by_compass.get(name, given[name])):
                if have != program.format(number):
                    raise ValueError(
                        f"input {name} of {program.name} must be {have} as it comes "
                        f"from the calibration, not {program.format(number)}"
                    )
    for program, schedule in zip(programs, schedules, strict=True):
        if min(schedule.latencies) - 1 <= max(schedule.gets):
            raise ValueError(
                f"{program.name} must take its record before its first output, not "
                f"an input in cycle {max(schedule.gets)} and an output in cycle "
                f"{min(schedule.latencies) - 1}"
            )
    counts = {p.format(n).frac for p in front for n in p.inputs if n not in front[0].inputs[-2:]}
    if len(counts) > 1:
        raise ValueError(f"raw counts must have one format, not {counts}")
    return Plan(
        word=programs[0].arithmetic.word,
        names=names,
        filters=filters,
        lengths=tuple(s.length for s in schedules),
        outputs=len(programs[0].outputs),
        count_bits=counts.pop(),
    )


def _input_names(program: Program) -> tuple[str, ...]:
    return tuple(program.values[n].name for n in program.inputs)
