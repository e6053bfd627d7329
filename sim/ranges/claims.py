"""Claims of ranges, and what is known of them before any log: proofs, and a search.

Claims have to be true for no word of a program to overflow. The interval of every other value
follows from those of its arguments, and its format holds it (`model.lowering.groups`). Two kinds
are assumed when a step is compiled: those stated with `ops.bounded`, by its author or by the
toolkit where it expands a function, and that a next state stays in the declared range of its state.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import Input, Param
from boresight.model.lowering.graph import Node
from boresight.model.recorded import drawn
from boresight.model.tools.files import kept
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Overflow
from boresight.sim.compare.twin import RANGE_SLACK, Traced, Twin, outside
from boresight.sim.levels.build import words_of
from boresight.sim.ranges.intervals import is_proven

#: Share of a range's larger magnitude, and last bits of its word, by which rounding may exceed it.
TOLERANCE = 1e-4
ROUNDING_LSB = 8.0


@dataclass(frozen=True, eq=False)
class Claim:
    node: Node  #: the value.
    low: float  #: to ``high``: the range.
    high: float
    reason: str  #: the author's reason, or "range of the state NAME".
    line: str  #: where it is stated.
    #: Number of the program's value that holds it; None if it is part of another operation.
    word: int | None
    lsb: float = 0.0  #: last bit of that word, or 0.
    state: str = ""  #: name of the state whose next value it is, or empty.
    #: Whether `ops.bounded` states the claim; otherwise the declaration of a state does.
    bounded: bool = True
    unless: str = ""  #: the exception that the author states, or empty.

    @property
    def ends(self) -> tuple[float, float]:
        """The range, widened by what rounding explains."""
        size = max(abs(self.low), abs(self.high))
        share = RANGE_SLACK * (self.high - self.low) if self.state else TOLERANCE * size
        slack = max(share, ROUNDING_LSB * self.lsb)
        return self.low - slack, self.high + slack

    def broken_by(self, seen: tuple[float, float]) -> bool:
        """Whether extremes lie beyond the range by more than rounding."""
        return not self.ends[0] <= seen[0] <= seen[1] <= self.ends[1]

    def share(self, low: float, high: float) -> float:
        """How far values from ``low`` to ``high`` go towards an end; above 1: beyond it."""
        if self.low < 0.0 < self.high:
            return max(low / self.low, high / self.high)
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        return max(middle - low, high - middle) / half if half else 1.0


def live(roots: Sequence[Node]) -> Iterator[Node]:
    """Yield the nodes that the roots need, each after its arguments."""
    visited = {node.number: node for node in roots}
    stack = list(visited.values())
    while stack:
        for arg in stack.pop().args:
            if arg.number not in visited:
                visited[arg.number] = arg
                stack.append(arg)
    yield from (visited[number] for number in sorted(visited))


def claims_of(of: Traced) -> list[Claim]:
    """List the claims of a compiled step in the order of computation; next states last."""
    program, nodes, values = of.program, of.nodes, of.value_of

    def lsb(value: int | None) -> float:
        return 0.0 if value is None else program.format(value).lsb

    state_ranges = {
        nodes[after].number: (program.values[state].low, program.values[state].high)
        for state, after in program.states
        if after in nodes
    }
    results = (*program.outputs, *(after for _, after in program.states))
    claims = []
    for part in live([nodes[n] for n in results if n in nodes]):
        if part.kind == "bounded" and state_ranges.get(part.number) != (part.low, part.high):
            stated, word = (part.low, part.high, part.reason, part.line), values.get(part.number)
            claims.append(Claim(part.args[0], *stated, word, lsb(word), unless=part.unless))
    clamped = {op.dest for op in program.ops if op.overflow is not Overflow.SAT}
    for state, after in program.states:
        declared, node = program.values[state], nodes.get(after)
        if node is None or after == state or after in clamped:
            continue
        # With another range than the state's, ops.bounded is a claim of its own.
        bounded = node.kind == "bounded" and state_ranges[node.number] == (node.low, node.high)
        name, value = declared.name, node.args[0] if bounded else node
        stated = declared.low, declared.high, f"range of the state {name}", node.line
        claim = Claim(value, *stated, after, lsb(after), state=name, bounded=bounded)
        claims.append(replace(claim, unless=node.unless) if bounded else claim)
    return claims


RUNS = 384  #: Runs side by side.
SELECT_EVERY = 8  #: Updates from one selection of runs to the next.
#: Runs that a selection continues from the farthest updates, and that it resets.
FOLLOWING, RESET = RUNS // 3, RUNS // 24
CLOSE = 0.99  #: Share of its range from which on a value is no goal any more.


@dataclass(frozen=True, eq=False)
class Witness:
    """Legal parameters and inputs that lead from a reset to a broken claim."""

    params: dict[str, float]  #: values that are not the defaults.
    inputs: dict[str, list[float]]  #: one number for each update after the reset.

    def __str__(self) -> str:
        updates = len(next(iter(self.inputs.values()), [0.0]))
        last = ", ".join(f"{name} = {values[-1]:.6g}" for name, values in self.inputs.items())
        text = f"update {updates} after a reset" + (f" with {last}" if last else "")
        return text + "".join(f" --param {name}={x:.6g}" for name, x in self.params.items())


class Search:
    """A search for inputs that take values to the ends of their ranges.

    Many runs of the integer program side by side, each with legal parameters and inputs: held,
    drawn anew, at their ends, near zero, or moved a little. Every few updates some of the runs
    continue from the update that took a value farthest so far, with other inputs, so that rare
    steps accumulate. Every state was reached by a run from a reset.
    """

    def __init__(self, of: Traced, claims: Sequence[Claim]) -> None:
        estimator, program = of.estimator, of.program
        self.estimator, self.program, self.claims = estimator, program, claims
        self.rng = np.random.default_rng(1)
        self.machine = Interpreter(program, RUNS)
        self.machine.params = {}  # each run has its own
        self.twin = Twin(of, self.machine.values)
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
        for k in range(updates):
            self._update()
            if k % SELECT_EVERY == SELECT_EVERY - 1:
                self._select()

    def witness(self, number: int) -> Witness:
        """Parameters and inputs from a reset to the farthest value of a claim."""
        rows: list[FloatArray] = []
        update, run = map(int, self.at[number])
        while update >= 0:
            inputs, params, parents = self.log[update]
            rows.append(inputs[:, run])
            parent = int(parents[run])
            update, run = (-1, run) if parent < 0 else divmod(parent, RUNS)
        values = np.array(rows[::-1])
        return Witness(
            {
                p.name: float(x)
                for p, x in zip(self.estimator.params, params[:, run], strict=True)
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
        machine.update(words_of(program, self.inputs.T).T)
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


#: Operations that the search runs by default, each on all runs: about half a second. A claim takes
#: as long as so many operations.
WORK, CLAIM = 20_000, 6
FEWEST, MOST = 8, 400  #: Fewest and most updates of each run.


@dataclass(frozen=True, eq=False)
class Examined:
    """A claim, with what a proof or a search says about it."""

    claim: Claim
    proven: bool  #: by intervals, without any claim that is not proven; then nothing was searched.
    reach: tuple[float, float] | None = None  #: extremes in the search, in the value's unit.
    #: Inputs that take the value out of its range, from an update that began with all states in
    #: theirs.
    witness: Witness | None = None


def examine(of: Traced, *, updates: int | None = None) -> list[Examined]:
    """Prove each claim by intervals, or search for inputs that break it.

    ``updates`` of each of the `RUNS` runs are by default as many as take about half a second. What
    the search finds is kept in the build cache.
    """
    claims = claims_of(of)
    proven = _proven(claims)
    tried = [claim for claim in claims if claim not in proven]
    if not tried:
        return [Examined(claim, proven=True) for claim in claims]
    if updates is None:
        cost = len(of.program.ops) + CLAIM * len(tried)
        updates = min(max(WORK // cost, FEWEST), MOST)
    # Everything that the search depends on: no texts, no source lines.
    nodes = [*live([claim.node for claim in tried])]
    plain = [replace(node, line="", reason="", unless="") for node in nodes]
    args = [[arg.number for arg in node.args] for node in nodes]
    stated = [(c.node.number, c.ends, c.low, c.high, c.word, c.state, c.bounded) for c in tried]
    of_program = of.program.digest, of.estimator.inputs, of.estimator.params
    identity = repr((np.__version__, updates, of_program, stated, plain, args))
    text = kept(f"search-{of.program.name}", identity, lambda: _searched(of, tried, updates))
    found = {}
    for claim, (reach, witness) in zip(tried, json.loads(text), strict=True):
        found[claim] = Examined(claim, False, tuple(reach), witness and Witness(*witness))
    return [found.get(claim, Examined(claim, proven=True)) for claim in claims]


def _searched(of: Traced, claims: Sequence[Claim], updates: int) -> str:
    """What a search finds of each claim, as JSON: its extremes, and the witness or null."""
    search = Search(of, claims)
    search.run(updates)
    reaches = zip(search.low.tolist(), search.high.tolist(), strict=True)
    witnesses = (search.witness(k) if search.broken[k] else None for k in range(len(claims)))
    return json.dumps(
        [(reach, w and (w.params, w.inputs)) for reach, w in zip(reaches, witnesses, strict=True)]
    )


def _proven(claims: Sequence[Claim]) -> set[Claim]:
    """Claims that follow from intervals, and from no claim that is not among them."""
    by_node = {(c.node.number, c.low, c.high): c for c in claims if not c.state}
    proven: set[Claim] = set()
    for claim in claims:  # in the order of computation
        needed = [
            by_node[key]
            for node in live([claim.node])
            if node.kind == "bounded"
            and (key := (node.args[0].number, node.low, node.high)) in by_node
        ]
        if proven.issuperset(needed) and is_proven(claim.node, *claim.ends):
            proven.add(claim)
    return proven
