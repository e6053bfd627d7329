"""The plan of a system's core: roles and formats of its programs, for the update controller.

The core of a complete system has the estimators, then the three programs of
`model.attitude.front`. An estimator that reads another one runs after it, on the same sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from boresight.gateware.attitude.system.feed import PLACES, Feed, feed_of
from boresight.gateware.schedule.slots import Schedule
from boresight.model.words.program import Program

#: The programs before the estimators, in the order of their numbers, which follow theirs.
FRONT_NAMES = ("calibrate_inertial", "calibrate_field", "compass_field")
_INERTIAL = tuple(f"{s}{a}" for s in "ga" for a in "xyz")
_FIELD = ("mx", "my", "mz")
#: Raw words of an inertial sample.
RAW = (*(f"{name}_counts" for name in _INERTIAL), "stamp", "restart")
#: Inputs and outputs of the programs before the estimators; None: any inputs.
_FRONT = ((RAW, (*_INERTIAL, "dt")), (tuple(f"{n}_counts" for n in _FIELD), _FIELD), (None, _FIELD))
#: Maximum words of a record, and maximum number of estimators.
_MOST_WORDS, _MOST_ESTIMATORS = 16, 8
#: Widths of the words of a complete system, bits.
SYSTEM_WORDS = range(26, 33)


@dataclass(frozen=True)
class Plan:
    """The programs of a core, for the update controller.

    Attributes
    ----------
    word : int
        W.
    names : tuple of str
        Names of the programs, by number.
    filters : int
        Number of estimators, which come first.
    lengths : tuple of int
        Cycles of each.
    outputs : tuple of int
        Words of each estimator's output record.
    chains : tuple of tuple of int
        For each estimator the programs of its update: those that it reads, then itself.
    feed : Feed
        Input routing of their records.
    count_bits : int
        Fraction bits of raw counts in the input words.
    early : bool
        Whether an estimator emits a word before it has taken the last word of its record.
    """

    word: int
    names: tuple[str, ...]
    filters: int
    lengths: tuple[int, ...]
    outputs: tuple[int, ...]
    chains: tuple[tuple[int, ...], ...]
    feed: Feed
    count_bits: int
    early: bool = False

    def __post_init__(self) -> None:
        records = (*map(len, self.feed.records), *self.outputs)
        if not 1 <= self.filters <= _MOST_ESTIMATORS or self.word not in SYSTEM_WORDS:
            raise ValueError(
                f"plan must have 1 to {_MOST_ESTIMATORS} estimators and words of "
                f"{SYSTEM_WORDS[0]} to {SYSTEM_WORDS[-1]} bits, "
                f"not {self.filters} and {self.word}"
            )
        if not all(1 <= words <= _MOST_WORDS for words in records):
            raise ValueError(f"records must have 1 to {_MOST_WORDS} words, not {records}")

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
    """The plan of a system's core: estimators first, then `FRONT_NAMES`.

    Parameters
    ----------
    programs : sequence of Program
        By number.
    schedules : sequence of Schedule
        Schedules of the programs.

    Raises
    ------
    ValueError
        The programs have another order or other records, or the front programs' outputs do not
        have the binary points of every estimator's inputs.
    """
    filters = len(programs) - len(FRONT_NAMES)
    names = tuple(p.name for p in programs)
    if filters < 1 or names[filters:] != FRONT_NAMES:
        raise ValueError(f"programs must be estimators, then {', '.join(FRONT_NAMES)}, not {names}")
    front = programs[filters:]
    _check_front(front)
    for program in programs[:filters]:
        _check_estimator(program, front)
    early = [min(s.latencies) - 1 <= max(s.gets) for s in schedules]
    if any(early[filters:]):
        raise ValueError("programs before the estimators must take all before they give a word")
    counts = {p.format(n).frac for p in front for n in p.inputs if n not in front[0].inputs[-2:]}
    if len(counts) > 1:
        raise ValueError(f"raw counts must have one format, not {counts}")
    return Plan(
        word=programs[0].arithmetic.word,
        names=names,
        filters=filters,
        lengths=tuple(s.length for s in schedules),
        outputs=tuple(len(p.outputs) for p in programs[:filters]),
        chains=tuple((k,) for k in range(filters)),
        feed=feed_of(programs[:filters]),
        count_bits=counts.pop(),
        early=any(early),
    )


def _check_front(front: Sequence[Program]) -> None:
    """Check that the programs before the estimators have the update controller's records."""
    for program, (inputs, outputs) in zip(front, _FRONT, strict=True):
        names = tuple(program.values[n].name for n in program.inputs)
        if program.output_names != outputs:
            raise ValueError(
                f"{program.name} must have the outputs {outputs}, not {program.output_names}"
            )
        if inputs is not None and names != inputs:
            raise ValueError(f"{program.name} must have the inputs {inputs}, not {names}")


def _check_estimator(program: Program, front: Sequence[Program]) -> None:
    """Check that an estimator's inputs have the formats of the calibrations."""
    for number in program.inputs:
        name, form = program.values[number].name, program.format(number)
        if name not in PLACES:
            continue
        for source in front:
            if name in source.output_names:
                expected = source.format(source.outputs[source.output_names.index(name)])
                if expected != form:
                    raise ValueError(
                        f"input {name} of {program.name} must be {expected} as it comes "
                        f"from the calibration, not {form}"
                    )
