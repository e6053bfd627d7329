"""What a log drove every value of a program to, and how far rounding moved it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from boresight.firmware.build import CModel, WordRanges
from boresight.model.words.fixed import IntArray
from boresight.model.words.program import Program
from boresight.sim.compare.results import CheckResult
from boresight.sim.compare.twin import rounding_errors

__all__ = ["Observed"]


@dataclass(frozen=True, eq=False)
class Observed:
    """One log on one program.

    Attributes
    ----------
    log : str
    words : int64 (n, n_inputs)
        Input words.
    ranges : WordRanges
        Extremes of every value, on the C model; states count with the words before each update.
    errors : mapping of int to float
        By value number: see `sim.compare.twin.rounding_errors`.
    """

    log: str
    words: IntArray
    ranges: WordRanges
    errors: Mapping[int, float]

    @classmethod
    def of(cls, program: Program, check: CheckResult) -> Observed:
        """What the record of a check did; ValueError if that was of another program."""
        ours, theirs = program.digest, check.build.programs[check.number].digest
        if ours != theirs:
            raise ValueError(f"check must belong to program {ours[:12]}, not {theirs[:12]}")
        assert check.fixed.states is not None
        words, nodes = check.given.words(program), check.build.nodes[check.number]
        return cls(
            check.given.record.name,
            words,
            CModel(program).observe(words),
            rounding_errors(program, nodes, words, check.fixed.states),
        )

    def headroom_bits(self, value: int, word: int) -> float:
        """How often the largest word seen could double before it left ``word`` bits.

        A value that was always zero has all bits but the sign's left.
        """
        low, high = int(self.ranges.low[value]), int(self.ranges.high[value])
        return word - 1 - math.log2(max(-low, high + 1, 1))
