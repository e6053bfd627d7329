"""A search for inputs that take values to the ends of their ranges.

Many runs of the integer program side by side, each with legal parameters and inputs: held, drawn
anew, at their ends, near zero, or moved a little. Every few updates some of the runs continue from
the update that took a value farthest so far, with other inputs, so that rare steps accumulate.
Every state was reached by a run from a reset.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.declarations import Input, Param
from boresight.model.estimator import Estimator
from boresight.model.lowering.graph import Node
from boresight.model.recorded import drawn
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Program
from boresight.sim.compare.twin import Twin, outside
from boresight.sim.ranges.claims import Claim
from boresight.sim.ranges.intervals import FloatArray

#: Runs side by side.
RUNS = 384
#: Updates from one selection of runs to the next.
SELECT_EVERY = 8
#: Runs that a selection continues from the farthest updates, and that it resets.
FOLLOWING, RESET = RUNS // 3, RUNS // 24
#: Share of its range from which on a value is no goal any more.
CLOSE = 0.99


@dataclass(frozen=True, eq=False)
class Reach:
    """How far a value came."""

    #: Extremes, in the value's unit.
    low: float
    high: float
    #: Whether it left its range in an update that began with all states in their ranges.
    broken: bool
    #: Where it came farthest, or first left the range.
    update: int
    run: int


@dataclass(frozen=True, eq=False)
class Witness:
    """Legal parameters and inputs that lead from a reset to a broken claim."""

    #: Values that are not the defaults.
    params: dict[str, float]
    #: One number for each update after the reset.
    inputs: dict[str, list[float]]

    def __str__(self) -> str:
        updates = len(next(iter(self.inputs.values()), [0.0]))
        last = ", ".join(f"{name} = {values[-1]:.6g}" for name, values in self.inputs.items())
        text = f"update {updates} after a reset" + (f" with {last}" if last else "")
        return text + "".join(f" --param {name}={x:.6g}" for name, x in self.params.items())


class Search:
    """The runs, and the values that they reached; arguments as of `examine.examine`."""

    def __init__(
        self,
        estimator: Estimator,
        program: Program,
        nodes: Mapping[int, Node],
        claims: Sequence[Claim],
        seed: int = 1,
    ) -> None:
        self.estimator, self.program, self.claims = estimator, program, claims
        self.rng = np.random.default_rng(seed)
        self.machine = Interpreter(program, RUNS)
        self.machine.params = {}  # each run has its own
        self.twin = Twin(program, dict(nodes), self.machine.values)
        self.initial = np.array([program.values[s].initial for s, _ in program.states], np.int64)
        self.states = np.tile(self.initial[:, None], RUNS)
        self.params = self._random(estimator.params)
        self.inputs = self._random(estimator.inputs)
        self.hold = np.sqrt(self.rng.uniform(size=RUNS))
        self.low = np.full(len(claims), np.inf)
        self.high = np.full(len(claims), -np.inf)
        self.broken = np.zeros(len(claims), dtype=np.bool_)
        self.at = np.zeros((len(claims), 2), dtype=np.int64)
        #: By claim, of the update that took its value farthest: inputs, parameters, states before
        #: and parent of the run.
        self.champions: dict[int, tuple[FloatArray, FloatArray, IntArray, int]] = {}
        #: By update: inputs, parameters, and the update and run from which each run continued.
        self.log: list[tuple[FloatArray, FloatArray, IntArray]] = []
        self.parents = np.full(RUNS, -1, dtype=np.int64)

    def run(self, updates: int) -> None:
        """Run a number of updates of each run."""
        for k in range(updates):
            self._update()
            if k % SELECT_EVERY == SELECT_EVERY - 1:
                self._select()

    def reach(self) -> list[Reach]:
        """Return how far each claim's value came."""
        return [
            Reach(float(low), float(high), bool(broken), int(update), int(run))
            for low, high, broken, (update, run) in zip(
                self.low, self.high, self.broken, self.at, strict=True
            )
        ]

    def witness(self, reach: Reach) -> Witness:
        """Return the parameters and inputs from a reset to a reached value."""
        rows: list[FloatArray] = []
        update, run = reach.update, reach.run
        while update >= 0:
            inputs, params, parents = self.log[update]
            rows.append(inputs[:, run])
            parent = int(parents[run])
            update, run = (-1, run) if parent < 0 else divmod(parent, RUNS)
        values = np.array(rows[::-1])
        return Witness(
            {
                p.name: float(x)
                for p, x in zip(self.estimator.params, params[:, reach.run], strict=True)
                if x != p.default
            },
            {i.name: values[:, k].tolist() for k, i in enumerate(self.estimator.inputs)},
        )

    def _update(self) -> None:
        program, machine = self.program, self.machine
        self.inputs = self._next_inputs()
        machine.states = self.states
        by_name = dict(zip((p.name for p in self.estimator.params), self.params, strict=True))
        for number in program.of_kind(Kind.PARAM):
            words = program.format(number).quantise(by_name[program.values[number].name])
            machine.values[number] = words
        machine.update(
            np.stack(
                [
                    program.format(number).quantise(values)
                    for number, values in zip(program.inputs, self.inputs, strict=True)
                ]
            )
        )
        update = len(self.log)
        self.log.append((self.inputs, self.params, self.parents))
        self.twin.words = machine.values_before_commit()
        with np.errstate(all="ignore"):
            self._observe(update)
        self.states = machine.states
        self.parents = update * RUNS + np.arange(RUNS)

    def _observe(self, update: int) -> None:
        """Extend the reached ranges by the values of an update."""
        twin, legal = self.twin, np.ones(RUNS, dtype=np.bool_)
        for state, _ in self.program.states:
            legal &= ~outside(twin.real(state), self.program.values[state])
        for k, claim in enumerate(self.claims):
            if self.broken[k] or not legal.any():
                continue
            low, high = claim.ends
            # Of the words of its arguments, where its own word is what may saturate.
            own = claim.state and not claim.bounded
            value = np.broadcast_to((twin.computed if own else twin.argument)(claim.node), RUNS)
            if claim.word is not None:
                value = self._in_word(claim.word, value)
            value = np.nan_to_num(value, posinf=claim.high, neginf=claim.low)
            beyond = legal & ((value < low) | (value > high))
            smallest, largest = value[legal].min(), value[legal].max()
            if smallest < self.low[k] or largest > self.high[k] or beyond.any():
                distance = np.abs(value - 0.5 * (claim.low + claim.high))
                run = int(np.select([beyond, legal], [np.inf, distance], -1.0).argmax())
                self.at[k] = update, run
                inputs, params = self.inputs[:, run].copy(), self.params[:, run].copy()
                parent = int(self.parents[run])
                self.champions[k] = inputs, params, self.states[:, run].copy(), parent
            self.broken[k] = beyond.any()
            self.low[k] = min(self.low[k], smallest)
            self.high[k] = max(self.high[k], largest)

    def _in_word(self, word: int, value: FloatArray) -> FloatArray:
        """The word of a value; where it saturated, the value itself, which lies beyond."""
        form, arithmetic = self.program.format(word), self.program.arithmetic
        words = self.twin.words[word]
        saturated = (words == arithmetic.max_int) & (value > form.max)
        saturated |= (words == arithmetic.min_int) & (value < form.min)
        return np.where(saturated, value, form.real(words))

    def _next_inputs(self) -> FloatArray:
        redrawn = self._random(self.estimator.inputs)
        spans = np.array([[i.low, i.high] for i in self.estimator.inputs])
        low, high = spans[:, :1], spans[:, 1:]
        step = self.rng.normal(0.0, 0.05, redrawn.shape) * (high - low)
        moved = np.clip(self.inputs + step, low, high)
        proposals = np.where(self.rng.random(redrawn.shape) < 0.3, moved, redrawn)
        return np.where(self.rng.random(redrawn.shape) > self.hold, proposals, self.inputs)

    def _select(self) -> None:
        """Continue some runs from the farthest updates, and restart some from a reset."""
        rng = self.rng
        self.states, self.params = self.states.copy(), self.params.copy()
        self.inputs, self.parents = self.inputs.copy(), self.parents.copy()
        goals = [
            k
            for k, claim in enumerate(self.claims)
            if k in self.champions and claim.share(self.low[k], self.high[k]) < CLOSE
        ] or [*self.champions]
        runs = rng.permutation(RUNS)
        for run in runs[: FOLLOWING if goals else 0]:
            self.inputs[:, run], self.params[:, run], self.states[:, run], self.parents[run] = (
                self.champions[goals[rng.integers(len(goals))]]
            )
            self.hold[run] = rng.uniform(0.3, 1.0)
        restarted = runs[FOLLOWING : FOLLOWING + RESET]
        self.states[:, restarted] = self.initial[:, None]
        self.params[:, restarted] = self._random(self.estimator.params)[:, :RESET]
        self.parents[restarted] = -1

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
