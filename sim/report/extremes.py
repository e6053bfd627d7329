"""Which range every value of a program really used, and which sample of which log drove it there.

Run on the C model: a minute of recording takes a few milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from boresight.firmware.build import CModel
from boresight.model.errors import InputError
from boresight.model.estimator import param_words
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program

__all__ = ["Extreme", "Extremes", "Observed", "observe"]


@dataclass(frozen=True)
class Extreme:
    """A word, its value in the value's unit, and the log and sample that first had it."""

    word: int
    value: float
    log: str
    sample: int


@dataclass(frozen=True)
class Observed:
    """What one value did over all logs.

    ``saturations`` counts the updates in which its `SAT` operation clamped it.
    """

    low: Extreme
    high: Extreme
    saturations: int

    def headroom_bits(self, word: int) -> float:
        """How often the largest word seen could double before it left ``word`` bits.

        A value that was always zero has all bits but the sign's left.
        """
        return word - 1 - math.log2(max(-self.low.word, self.high.word + 1, 1))


@dataclass(frozen=True)
class Extremes:
    """Observed ranges of a program.

    Attributes
    ----------
    program : Program
        What was run.
    updates : dict of log name to number of updates
    values : tuple of Observed, by value number
        States count with the words before each update.
    """

    program: Program
    updates: dict[str, int]
    values: tuple[Observed, ...]

    @property
    def total(self) -> int:
        """Updates in all."""
        return sum(self.updates.values())

    @property
    def saturations(self) -> int:
        """Clamped results in all."""
        return sum(v.saturations for v in self.values)


def observe(
    program: Program, runs: Mapping[str, IntArray], *, params: Mapping[str, float] | None = None
) -> Extremes:
    """Run a program over logs, each from its reset words, and note the extremes of every value.

    Parameters
    ----------
    program : Program
        What to run.
    runs : mapping of log name to int64 (n, n_inputs)
        Input words of each log.
    params : mapping, optional
        Parameters by name, in their units; those that are not named keep their defaults.

    Raises
    ------
    InputError
        No log, or a log without samples.
    """
    for name, words in runs.items():
        if not len(words):
            raise InputError.at(
                f"log {name!r}", wanted="one sample or more", found="none", fix="use a longer log"
            )
    if not runs:
        raise InputError.at("logs", wanted="one or more", found="none", fix="name a log")
    model = CModel(program)
    if params:
        named = {
            v.name: float(program.format(n).real(v.initial)) for n, v in enumerate(program.values)
        } | dict(params)
        for number, word in param_words(program, named).items():
            model.set_param(program.values[number].name, word)
    seen = {}
    for name, words in runs.items():
        model.reset()
        seen[name] = model.observe(words)
    values = []
    for n in range(len(program.values)):
        low = min((int(r.low[n]), k) for k, r in enumerate(seen.values()))
        high = max((int(r.high[n]), -k) for k, r in enumerate(seen.values()))
        ends = []
        for word, k, at in ((low[0], low[1], "low_at"), (high[0], -high[1], "high_at")):
            name = list(seen)[k]
            ends.append(
                Extreme(
                    word, float(program.format(n).real(word)), name, int(getattr(seen[name], at)[n])
                )
            )
        values.append(Observed(ends[0], ends[1], sum(int(r.saturations[n]) for r in seen.values())))
    return Extremes(program, {name: len(words) for name, words in runs.items()}, tuple(values))
