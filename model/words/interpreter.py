"""Integer interpreter: runs a program bit by bit, many independent runs at once in numpy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import BoolArray
from boresight.model.words.fixed import (
    IntArray,
    fraction,
    leading_sign_count,
    saturate,
    table_index,
    wrap,
)
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Scale, Term, When
from boresight.model.words.single import Update, single

__all__ = ["Interpreter"]

#: Number of runs up to which plain integers are faster than arrays.
FEW = 16


class Interpreter:
    """Interpreter of a `Program`, bit by bit as the core; a few runs in plain integers.

    Parameters
    ----------
    program : Program
        Program to run.
    runs : int
        Number of independent runs; every word is an int64 array of that length.

    Attributes
    ----------
    values : list of int64 arrays (runs,)
        Every word of the last update by value number (states: the words *before* the update).
    params : dict of value number to word
        Parameters; assign to change.
    saturations : int64 array (number of values,)
        Number of saturations of each value since the start, over all runs.
    """

    def __init__(self, program: Program, runs: int = 1) -> None:
        if runs < 1:
            raise ValueError(f"runs must be at least 1, not {runs!r}")
        self.program = program
        self.runs = runs
        self.params = {n: program.values[n].initial for n in program.of_kind(Kind.PARAM)}
        self.values: list[IntArray] = [
            np.full(runs, v.initial, dtype=np.int64) for v in program.values
        ]
        self.saturations = np.zeros(len(program.values), dtype=np.int64)
        self._tables = np.array(program.table_memory, dtype=np.int64)
        self._previous_states = [self.values[n] for n, _ in program.states]
        self._update: Update | None = None  # of one run, made at its first use

    def update(self, inputs: npt.ArrayLike) -> tuple[IntArray, BoolArray]:
        """Run one update.

        Parameters
        ----------
        inputs : int64 (n_inputs, runs)
            Input words in stream order.

        Returns
        -------
        outputs : int64 (n_outputs, runs)
        saturated : bool (runs,)
            Whether a `SAT` operation of this update clamped its result.

        Raises
        ------
        ValueError
            The shape is wrong, or a word or parameter is not an integer that fits.
        """
        p = self.program
        words = np.asarray(inputs)
        if words.dtype.kind not in "iu":
            raise ValueError(f"inputs must be integer words, not {words.dtype}")
        if words.shape != (len(p.inputs), self.runs):
            raise ValueError(
                f"inputs must have shape {(len(p.inputs), self.runs)}, not {words.shape}"
            )
        if words.size and (
            words.min() < p.arithmetic.min_int or words.max() > p.arithmetic.max_int
        ):
            raise ValueError(f"input words must fit {p.arithmetic.word} bits")
        for number, word in zip(p.inputs, words.astype(np.int64), strict=True):
            self.values[number] = word
        for number, param in self.params.items():
            if not p.arithmetic.min_int <= param <= p.arithmetic.max_int:
                raise ValueError(
                    f"parameter {p.values[number].name} must fit "
                    f"{p.arithmetic.word} bits, not {param!r}"
                )
            self.values[number] = np.full(self.runs, param, dtype=np.int64)
        saturated = self._scalar_update() if self.runs <= FEW else self._array_update()
        outputs = np.stack([self.values[n] for n in p.outputs])
        self._previous_states = [self.values[n] for n, _ in p.states]
        after = [self.values[n] for _, n in p.states]
        for (state, _), word in zip(p.states, after, strict=True):
            self.values[state] = word
        return outputs, saturated

    def run(
        self, inputs: npt.ArrayLike, progress: Callable[[int], None] | None = None
    ) -> tuple[IntArray, BoolArray]:
        """Run many updates: ``inputs`` (steps, n_inputs, runs).

        Returns outputs (steps, n_outputs, runs) and saturated (steps, runs).
        """
        words = np.asarray(inputs)
        out = np.empty((len(words), len(self.program.outputs), self.runs), dtype=np.int64)
        sat = np.empty((len(words), self.runs), dtype=np.bool_)
        for k, row in enumerate(words):
            out[k], sat[k] = self.update(row)
            if progress is not None:
                progress(k)
        return out, sat

    @property
    def states(self) -> IntArray:
        """Words of the states that the next update reads, (n_states, runs); assign to change."""
        words = [self.values[state] for state, _ in self.program.states]
        return np.array(words, dtype=np.int64).reshape(len(words), self.runs)

    @states.setter
    def states(self, words: IntArray) -> None:
        for (state, _), word in zip(self.program.states, words, strict=True):
            self.values[state] = word

    def values_before_commit(self) -> list[IntArray]:
        """`values` of the last update, with the states that it read instead of the next states."""
        words = list(self.values)
        for (state, _), word in zip(self.program.states, self._previous_states, strict=True):
            words[state] = word
        return words

    def _scalar_update(self) -> BoolArray:
        """Run all operations, run by run; return which runs saturated."""
        if self._update is None:
            self._update = single(self.program)
        runs = np.stack(self.values).T.tolist()
        saturated = np.zeros(self.runs, dtype=np.bool_)
        for k, words in enumerate(runs):
            clamped = self._update(words, self.program.table_memory)
            saturated[k] = bool(clamped)
            for number in clamped:
                self.saturations[number] += 1
        self.values = list(np.ascontiguousarray(np.array(runs, dtype=np.int64).T))
        return saturated

    def _array_update(self) -> BoolArray:
        """Run all operations on arrays of runs; return which runs saturated."""
        saturated = np.zeros(self.runs, dtype=np.bool_)
        for op in self.program.ops:
            self.values[op.dest], clamped = self._run(op)
            if clamped is not None:
                saturated |= clamped
                self.saturations[op.dest] += int(np.count_nonzero(clamped))
        return saturated

    def _run(self, op: Op) -> tuple[IntArray, BoolArray | None]:
        arith = self.program.arithmetic
        v = self.values
        flag = None
        if op.flag is not None:
            flagged = v[op.flag]
            if op.flag_quarter:
                flagged = wrap(flagged + (1 << (arith.word - 2)), arith.word)
            flag = flagged < 0
        norm = leading_sign_count(v[op.norm], arith) if op.norm is not None else None
        base = None
        if op.table is not None:
            assert op.index is not None
            base = 512 * op.table + 4 * table_index(v[op.index], arith, op.index_quarter)
        acc = np.full(self.runs, 1 << (arith.guard - 1), dtype=np.int64)
        for term in op.terms:
            acc += self._term(term, flag, norm, base)
        q = acc >> arith.guard
        if op.overflow is Overflow.WRAP:
            return wrap(q, arith.word), None
        word: IntArray = saturate(q, arith.word)
        return word, (word != q) if op.overflow is Overflow.SAT else None

    def _term(
        self, term: Term, flag: BoolArray | None, norm: IntArray | None, base: IntArray | None
    ) -> IntArray:
        arith = self.program.arithmetic
        a = self.values[term.a]
        if term.fraction_a:
            a = fraction(a, arith)
        if term.coefficient is not None:
            assert base is not None
            b = self._tables[base + term.coefficient]
        else:
            assert term.b is not None
            b = self.values[term.b]
            if term.fraction_b:
                b = fraction(b, arith)
        product = a * b
        if term.scale is Scale.NONE:
            r = product >> term.shift
        else:
            assert norm is not None
            count = {Scale.FULL: norm, Scale.EVEN: norm & ~1, Scale.HALF: norm >> 1}[term.scale]
            r = product >> np.maximum(term.shift - count, 0)
        if term.negate is Negate.YES:
            r = -r
        elif term.negate is not Negate.NO:
            assert flag is not None
            r = np.where(flag == (term.negate is Negate.IF), -r, r)
        if term.when is not When.ALWAYS:
            assert flag is not None
            r = np.where(flag == (term.when is When.IF), r, 0)
        return r
