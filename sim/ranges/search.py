"""A search for inputs that take values to the ends of their ranges.

Many runs of the integer program side by side, each with legal parameters and inputs: held, drawn
anew, at their ends, near zero, or moved a little. Every few updates some of the runs continue from
the update that took a value farthest so far, with other inputs, so that rare steps accumulate.
Every state was reached by a run from a reset.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import Input, Param
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.recorded import drawn
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.twin import Twin
from boresight.sim.ranges.claims import Claim

__all__ = ["RUNS", "Reach", "Search"]

FloatArray = npt.NDArray[np.float64]

#: Runs side by side; updates between two selections, in which one run in _FOLLOW continues from a
#: farthest update and one in _RESET from a reset; share of its range up to which a claim is a goal.
RUNS, _EVERY, _FOLLOW, _RESET, _CLOSE = 384, 8, 3, 24, 0.99


@dataclass(frozen=True, eq=False)
class Reach:
    """How far a value came.

    Attributes
    ----------
    low, high : float
        In its unit.
    is_violated : bool
        Whether its word left the range, or was saturated.
    update, run : int
        Where it came farthest, or first left the range.
    """

    low: float
    high: float
    is_violated: bool
    update: int
    run: int


class Search:
    """The runs, and the values that they reached.

    Parameters
    ----------
    estimator : Estimator
    program, nodes
        As `Estimator.compile_traced` gives them.
    claims : sequence of Claim
    seed : int
    drawn_states : callable, optional
        Replaces some of the states (n_states, runs) before every update; no run from a reset need
        reach these.
    """

    def __init__(
        self,
        estimator: Estimator,
        program: Program,
        nodes: Mapping[int, Node],
        claims: Sequence[Claim],
        seed: int = 1,
        *,
        drawn_states: Callable[[np.random.Generator, IntArray], IntArray] | None = None,
    ) -> None:
        self.estimator, self.program, self.claims = estimator, program, claims
        self.drawn_states = drawn_states
        self.nodes = dict(nodes)
        self.rng = np.random.default_rng(seed)
        self.machine = Interpreter(program, RUNS)
        self.machine.params = {}  # of each run its own
        initial = [np.full(RUNS, program.values[s].initial) for s, _ in program.states]
        self.states = np.array(initial, dtype=np.int64).reshape(len(initial), RUNS)
        self.params = self._random(estimator.params)
        self.inputs = self._random(estimator.inputs)
        self.hold = np.sqrt(self.rng.uniform(size=RUNS))
        self.low = np.full(len(claims), np.inf)
        self.high = np.full(len(claims), -np.inf)
        self.violations = np.zeros(len(claims), dtype=np.bool_)
        self.at = np.zeros((len(claims), 2), dtype=np.int64)
        self.champions: dict[int, tuple[Any, ...]] = {}
        self.log: list[tuple[FloatArray, FloatArray, IntArray]] = []
        self.parents = np.full(RUNS, -1, dtype=np.int64)

    def run(self, updates: int, progress: Callable[[str], None] = lambda text: None) -> None:
        """Run a number of updates of each run."""
        for k in range(updates):
            self._update()
            if k % _EVERY == _EVERY - 1:
                self._select()
                progress(f"{(k + 1) * RUNS:,} of {updates * RUNS:,} updates")

    def reach(self) -> list[Reach]:
        """How far each claim's value came."""
        return [
            Reach(float(a), float(b), bool(c), int(k), int(r))
            for a, b, c, (k, r) in zip(self.low, self.high, self.violations, self.at, strict=True)
        ]

    def path(self, reach: Reach) -> tuple[dict[str, float], FloatArray]:
        """Parameters, and inputs (updates, n_inputs), from a reset to the reached value."""
        rows: list[FloatArray] = []
        update, run = reach.update, reach.run
        while update >= 0:
            inputs, params, parents = self.log[update]
            rows.append(inputs[:, run])
            parent = int(parents[run])
            update, run = (-1, run) if parent < 0 else divmod(parent, RUNS)
        names = [p.name for p in self.estimator.params]
        return dict(zip(names, params[:, reach.run], strict=True)), np.array(rows[::-1])

    def _update(self) -> None:
        program, machine = self.program, self.machine
        self.inputs = self._next_inputs()
        if self.drawn_states is not None:
            self.states = self.drawn_states(self.rng, self.states)
        for (number, _), words in zip(program.states, self.states, strict=True):
            machine.values[number] = words
        by_name = dict(zip((p.name for p in self.estimator.params), self.params, strict=True))
        for number in program.of_kind(Kind.PARAM):
            words = program.format(number).quantise(by_name[program.values[number].name])
            machine.values[number] = words
        record = [
            program.format(n).quantise(values)
            for n, values in zip(program.inputs, self.inputs, strict=True)
        ]
        machine.update(np.stack(record))
        update = len(self.log)
        self.log.append((self.inputs, self.params, self.parents))
        with np.errstate(all="ignore"):
            self._observe(Twin(program, self.nodes, machine.values_before_commit()), update)
        next_states = [machine.values[n] for n, _ in program.states]
        self.states = np.array(next_states, dtype=np.int64).reshape(len(next_states), RUNS)
        self.parents = update * RUNS + np.arange(RUNS)

    def _observe(self, twin: Twin, update: int) -> None:
        """Extend the reached ranges by the values of an update."""
        for k, claim in enumerate(self.claims):
            low, high = claim.ends
            value = np.broadcast_to(twin.argument(claim.node), RUNS)
            if claim.word is not None:
                value = self._effective(twin, claim, claim.word, value)
            value = np.nan_to_num(value, posinf=claim.high, neginf=claim.low)
            outside = (value < low) | (value > high)
            run = int(np.where(outside, np.inf, np.abs(value)).argmax())
            is_farther = max(-self.low[k], self.high[k]) < abs(value[run])
            if not self.violations[k] and (is_farther or outside.any()):
                self.at[k] = update, run
                copies = (array[:, run].copy() for array in (self.inputs, self.params, self.states))
                self.champions[k] = (*copies, int(self.parents[run]))
            self.violations[k] |= bool(outside.any())
            self.low[k] = min(self.low[k], value.min())
            self.high[k] = max(self.high[k], value.max())

    def _effective(self, twin: Twin, claim: Claim, word: int, value: FloatArray) -> FloatArray:
        """The word of a value; where it saturated, the value itself, which lies beyond."""
        form, words, real = self.program.format(word), twin.words[word], twin.real(word)
        slack = 2.0 * form.lsb
        real = np.where((real > claim.high) & (real <= claim.high + slack), claim.high, real)
        real = np.where((real < claim.low) & (real >= claim.low - slack), claim.low, real)
        max_min = self.program.arithmetic.max_int, self.program.arithmetic.min_int
        is_saturated = (words == max_min[0]) & (value > form.max + slack)
        is_saturated |= (words == max_min[1]) & (value < form.min - slack)
        return np.where(is_saturated, value, real)

    def _next_inputs(self) -> FloatArray:
        redrawn = self._random(self.estimator.inputs)
        spans = np.array([[i.low, i.high] for i in self.estimator.inputs])
        low, high = spans[:, :1], spans[:, 1:]
        step = self.rng.normal(0.0, 0.05, redrawn.shape) * (high - low)
        proposals = np.where(
            self.rng.random(redrawn.shape) < 0.3, np.clip(self.inputs + step, low, high), redrawn
        )
        return np.where(self.rng.random(redrawn.shape) > self.hold, proposals, self.inputs)

    def _select(self) -> None:
        """Continue some runs from the farthest updates, and restart some from a reset."""
        rng = self.rng
        self.states, self.params = self.states.copy(), self.params.copy()
        self.inputs, self.parents = self.inputs.copy(), self.parents.copy()
        sizes = np.array([c.size for c in self.claims])
        shares = np.maximum(-self.low, self.high) / np.maximum(sizes, 1e-300)
        goals = [k for k in self.champions if shares[k] < _CLOSE] or [*self.champions]
        runs = rng.permutation(RUNS)
        follow_count, reset_count = RUNS // _FOLLOW, RUNS // _RESET
        for run in runs[: follow_count if goals else 0]:
            inputs, params, states, parent = self.champions[goals[rng.integers(len(goals))]]
            self.inputs[:, run], self.params[:, run] = inputs, params
            self.states[:, run], self.parents[run] = states, parent
            self.hold[run] = rng.uniform(0.3, 1.0)
        reset_runs = runs[follow_count : follow_count + reset_count]
        initial = [self.program.values[s].initial for s, _ in self.program.states]
        if initial:
            self.states[:, reset_runs] = np.array(initial)[:, None]
        self.params[:, reset_runs] = self._random(self.estimator.params)[:, : len(reset_runs)]
        self.parents[reset_runs] = -1

    def _random(self, declarations: Sequence[Input | Param]) -> FloatArray:
        """Legal values (declarations, runs); of a parameter often the default."""
        rows = []
        for declaration in declarations:
            default = declaration.default if isinstance(declaration, Param) else 0.0
            row = drawn(self.rng, declaration, default, RUNS)
            if isinstance(declaration, Param):
                row = np.where(self.rng.random(RUNS) < 0.4, default, row)
            rows.append(row)
        return np.array(rows).reshape(len(declarations), RUNS)
