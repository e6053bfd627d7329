"""Profiles: ranges that runs showed, for the formats of a program's values.

A profile moves binary points. Which side of a selection can be taken, which sign a value may have
and what saturates on purpose follow from intervals as without one. It belongs to one record of one
step; of another it is refused.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from boresight.model.errors import InputError, require
from boresight.model.tools.reading import parse_json

if TYPE_CHECKING:
    from boresight.model.declarations import Input
    from boresight.model.lowering.trace import Trace

#: Beginning of the source of a range that a profile chose.
OBSERVED = "observed in"
#: Smallest and largest value.
Range: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Profile:
    """Ranges of one estimator's values.

    ``record`` is the `record_digest` of the step that was run on the ``logs``; ``ranges`` are for
    the formats, by the number of the expression, of a comparison that of the difference; ``limits``
    those of the last argument of a division or root whose interval does not exclude zero; ``place``
    is the file that it was read from.
    """

    estimator: str
    record: str
    logs: Sequence[str]
    ranges: Mapping[int, Range] = field(repr=False)
    limits: Mapping[int, Range] = field(default_factory=dict, repr=False)
    place: str = "profile"

    @property
    def source(self) -> str:
        """Where its ranges come from, for a report."""
        return f"{OBSERVED} {', '.join(self.logs)}"

    def __str__(self) -> str:
        if not self.ranges and not self.limits:
            return f"profile {self.place}: no formats, since none {self.source} is more exact"
        values = f"formats of {len(self.ranges)} values, {self.source}"
        return f"profile {self.place}: {values}; beyond these ranges a word saturates"

    def check(self, trace: Trace, name: str, inputs: Sequence[Input]) -> Profile:
        """Return it with the numbers of this record of a step; see `record_digest`.

        InputError: it was made of another step or other declarations.
        """
        place = {number: k for k, number in enumerate(_declared_numbers(trace, inputs))}
        found = ""
        if name != self.estimator:
            found = f"one of {self.estimator}"
        elif record_digest(trace, inputs) != self.record:
            found = "one of another step or other declarations"
        elif unknown := sorted((self.ranges.keys() | self.limits.keys()) - place.keys()):
            found = f"one with a value {unknown[0]}"
        fix = "run boresight fit again, or leave it out with --profile none"
        require(not found, self.place, f"a profile of {name} as it is now", found, fix)
        ranges = {place[number]: range_ for number, range_ in self.ranges.items()}
        limits = {place[number]: range_ for number, range_ in self.limits.items()}
        return replace(self, ranges=ranges, limits=limits)


def _declared_numbers(trace: Trace, inputs: Sequence[Input]) -> list[int]:
    """Number that each expression has in the record of the inputs as declared.

    Clamps of words of a source follow the leaves of a record; there they are the inputs themselves.
    """
    clamped = [e.number for e, i in zip(trace.inputs, inputs, strict=True) if i.beyond]
    leaves = len(inputs) + len(trace.params) + len(trace.states)
    after = range(leaves, len(trace.tracer.expressions) - len(clamped))
    return [*range(leaves), *clamped, *after]


def record_digest(trace: Trace, inputs: Sequence[Input]) -> str:
    """Digest of a recorded step with its declarations, without lines.

    The ranges of inputs are those of ``inputs``, as declared, and not clamped: in a core that
    several programs share the record has those of their sources.
    """
    ranges = {i.name: [i.low, i.high] for i in inputs}
    numbers = _declared_numbers(trace, inputs)

    def description(e: Any) -> list[Any]:
        if e.kind == "leaf" and e.data[0] == "input":
            return [*e.key[:-3], *ranges[e.data[1]], *e.key[-1:]]
        return [e.kind, *(numbers[arg.number] for arg in e.args), *e.data]

    declared = {numbers[e.number]: e for e in reversed(trace.tracer.expressions)}
    outputs = {n: numbers[e.number] for n, e in trace.outputs.items()}
    content = [
        [description(declared[number]) for number in sorted(declared)],
        [[e.number for e in trace.inputs], outputs],
        [[e.number, default] for e, default, _ in trace.params],
        [[e.number, initial, numbers[after.number]] for e, initial, after in trace.states],
    ]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def read_profile(path: str | Path) -> Profile:
    """A profile that `boresight fit` wrote.

    InputError: there is no such file, or it holds something else.
    """
    found = "another kind of file"
    try:
        data = parse_json(b"" if Path(path).is_char_device() else Path(path).read_bytes())
        rows = (data["values"], data["limits"])
        values, limits = ({int(r["number"]): _range(*r["chosen"]) for r in each} for each in rows)
        logs = [str(log["log"]) for log in data["made_from"]]
        return Profile(str(data["estimator"]), str(data["record"]), logs, values, limits, str(path))
    except OSError as error:
        found = (error.strerror or type(error).__name__).lower()
    except (ArithmeticError, KeyError, TypeError, ValueError):
        pass
    fix = "write it with boresight fit"
    raise InputError.at(str(path), wanted="a profile", found=found, fix=fix)


def _range(low: float, high: float) -> Range:
    low, high = float(low), float(high)
    if not (low <= high and math.isfinite(low + high)):
        raise ValueError
    return low, high
