"""What is refused before anything runs: no core of it could be right."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, placed
from boresight.model.lowering.resolution import check_resolution, limits
from boresight.model.recorded import check_recorded, evaluate, sample
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.twin import Traced, Twin
from boresight.sim.levels.build import Build

#: Drawn updates in which words have to move, and the fewest of them without a saturation.
ROWS, FEWEST_CLEAN = 128, 16
#: Share of these updates in which float64 has to leave a word that stands still.
MOVING_SHARE = 0.1
FACTOR = 4.0  #: How many times the accepted error it has to leave it by.


def check_sound(build: Build, inputs: Sequence[FloatArray] | None = None) -> None:
    """Refuse estimators whose record is not their step, or whose words cannot hold what they are.

    ``inputs`` (rows, n_inputs) of each estimator are in their units, for its parameters as chosen;
    by default drawn from the declared ranges. Raises InputError as `model.recorded.check_recorded`
    and `model.lowering.resolution.check_resolution`, or where the word of an output or next state
    stands still and float64 moves by more than it may be off: in updates of drawn states in which
    nothing saturates.
    """
    for k, estimator in enumerate(build.estimators):
        own, chosen = None if inputs is None else inputs[k], build.values[k]
        check_recorded(estimator, own, None if own is None else chosen)
        check_resolution(build.programs[k], build.nodes[k])
        _check_moving(Traced.of(build, k), sample(estimator, own, chosen))


def _check_moving(of: Traced, leaves: Mapping[tuple[str, str], FloatArray]) -> None:
    """Raise InputError where a word stands still that moves in float64."""
    estimator, program, nodes = of.estimator, of.program, of.nodes
    leaves = {name: values[:ROWS] for name, values in leaves.items()}
    rows = len(next(iter(leaves.values())))
    machine = Interpreter(program, rows)
    for (number, _), state in zip(program.states, estimator.states, strict=True):
        machine.values[number] = program.format(number).quantise(leaves["state", state.name])
    inputs = [
        program.format(number).quantise(leaves["input", i.name])
        for number, i in zip(program.inputs, estimator.inputs, strict=True)
    ]
    clean = ~machine.update(np.stack(inputs))[1]
    if np.count_nonzero(clean) < FEWEST_CLEAN:
        return
    twin = Twin(of, [words[clean] for words in machine.values_before_commit()])
    trace = estimator.trace()
    results = [*trace.outputs.values(), *(after for _, _, after in trace.states)]
    with np.errstate(all="ignore"):
        values = evaluate(trace, leaves)
        for (number, limit, what), result in zip(limits(program, nodes), results, strict=True):
            exact = np.broadcast_to(values[result.number], rows)[clean]
            form = program.format(number)
            error = np.abs(np.clip(exact, form.min, form.max) - twin.real(number))
            decided = number not in nodes  # a constant, by a claim that is compared on its own
            if (
                not decided
                and _still(twin, number)
                and np.mean(error > FACTOR * limit) > MOVING_SHARE
            ):
                lost = next(_lost(twin, number), number)
                said, line = program.values[lost], nodes[lost].line if lost in nodes else ""
                raise InputError.at(
                    placed(line, f"{program.name}, value {said.name}"),
                    wanted=f"an LSB that resolves its changes, for {what}",
                    found=f"{program.format(lost).lsb:.3g}, for the range {nodes[lost].range}",
                    fix="limit what it is made of with ops.bounded or ops.clip",
                )


def _still(twin: Twin, number: int) -> bool:
    return int(np.ptp(twin.words[number])) == 0


def _lost(twin: Twin, number: int) -> Iterator[int]:
    """Values that a value is made of which stand still though their arguments move, first first."""
    needed = {number}
    for op in reversed(twin.program.ops):
        if op.dest in needed:
            needed.update(op.operands())
    for op in twin.program.ops:
        part = op.dest in needed and op.dest in twin.nodes and _still(twin, op.dest)
        if part and np.ptp(twin.computed(twin.nodes[op.dest])) > 0.0:
            yield op.dest
