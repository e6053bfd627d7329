"""`boresight simulate WORLD ESTIMATOR`: a closed loop, in which the outputs move the plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from boresight.arguments import SEED_MOST, check_machine, check_optional
from boresight.model.errors import require_choice
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import OutputFile
from boresight.options import Config, EstimatorName, Params, Word
from boresight.sim.answer import Answer
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.compare.verdict import judge
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.records.files import content_of
from boresight.sim.worlds.loop import Loop, close_loop, parting
from boresight.sim.worlds.world import NamedWorld, drawn, world_of

__all__ = ["LoopResult", "simulate_world"]


#: Levels without words.
_FLOATS = {"numpy", "float"}


@dataclass(frozen=True, eq=False)
class LoopResult(Answer):
    """Result of `simulate_world`.

    Attributes
    ----------
    world, estimator, on, against : str
        Names, and the two levels.
    good : bool
        Integer levels do not part, the outputs are as near to float64 as accepted, nothing
        saturates and no state leaves its declared range: of the first loop, or of the second where
        that alone has words. Where neither has, this says nothing of fixed point.
    records : int
        Records of the first loop.
    records_per_s : int
        Its rate.
    parting : str or None
        First difference of the levels.
    accuracy, truth : tuple of Difference
        Outputs from float64 on the same records, and from the world's truths.
    clamped : mapping of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    saturated_updates : int
        Updates of the judged loop in which an operation was clamped.
    unused : sequence of str
        What the world gave that is no input and no truth of an output.
    causes : sequence of str
        Values that saturated, states beyond their ranges, and the first failing operation, one line
        each.
    """

    world: str
    estimator: str
    on: str
    against: str
    good: bool
    records: int
    records_per_s: int
    parting: str | None
    accuracy: tuple[Difference, ...]
    truth: tuple[Difference, ...]
    clamped: Mapping[str, int]
    saturated_updates: int
    unused: Sequence[str]
    causes: Sequence[str]

    def __str__(self) -> str:
        lines = [
            f"{self.world} and {self.estimator} on {self.on}: {self.records:,} records, "
            f"{self.records_per_s:,} a second"
        ]
        if self.parting is not None:
            lines.append(self.parting)
        elif self.against != self.on:
            lines.append(f"the same records and outputs as on {self.against}, bit by bit")
        for name, deviations in (
            ("from float64 on the same records", self.accuracy),
            ("from truth", self.truth),
        ):
            lines += [
                f"{d.output} {name}: max {d.largest:.4g} {d.unit}".rstrip()
                + f", rms {d.rms:.4g}"
                + ("" if d.good else f", BEYOND {d.tolerance:g}")
                for d in deviations
                if math.isfinite(d.largest)
            ]
        if self.unused:
            lines.append(
                f"not used of what {self.world} gives: {', '.join(self.unused)}: no input, or "
                f"OUTPUT_true, of {self.estimator}"
            )
        verdict = "good" if self.good else "FAILED"
        if self.good and {self.on, self.against} <= _FLOATS:
            verdict = "no fixed point was judged: choose --on fixed, c or rtl"
        return "\n".join([*lines, *self.causes, verdict])


def simulate_world(
    world: NamedWorld,
    estimator: EstimatorName,
    *,
    on: str = "c",
    against: str | None = None,
    config: Config = "small",
    word: Word = 32,
    params: Params = None,
    steps: int | None = None,
    seed: int | None = None,
    output: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> LoopResult:
    """Close the loop of a world and an estimator on one level, and again on another.

    Integer levels (fixed, c, rtl) give the same loop, bit by bit: where they part, something is
    wrong. Float64 is run on the records that the first loop saw, since loops of their own part
    sooner or later: its differences are judged by the outputs' tolerances. Of a loop on float64
    and one on integers, the one on integers is judged.

    Parameters
    ----------
    world : str, class or World
        ``file.py:Class``, a class or an object.
    estimator : str, class or Estimator
    on : str
        Level in the loop of a world: float, numpy, fixed, c or rtl.
    against : str, optional
        A second level, compared; by default c, with float and numpy none.
    steps : int, optional
        Most records of a world; by default until it ends.
    seed : int, optional
        Of the world's draw, as montecarlo takes it; by default the world as it is.
    output : path, optional
        CSV of the records that the first loop saw, with truths: a log.

    Returns
    -------
    LoopResult
        Whether the levels agree, and how far the outputs are from float64 and from truth.

    Raises
    ------
    InputError
        Nothing of that name; a world that raises or gives what is no record.
    """
    plant, filter = world_of(world), estimator_of(estimator)
    against = against or (on if on in _FLOATS else "c")
    for name, level in (("on", on), ("against", against)):
        require_choice(name, level, LEVELS)
    check_machine(config, word)
    check_optional("steps", steps, 1)
    check_optional("seed", seed, 0, SEED_MOST)
    if seed is not None:
        drawn(plant, seed)
    build = Build(filter, config=config, word=word, params=[params])
    target = None if output is None else OutputFile(output)
    say = progress or (lambda text: None)

    def close(name: str) -> Loop:
        say(f"{plant.name} and {filter.name} on {name}")
        with make_level(name, build) as level:
            return close_loop(
                plant, level, steps=steps, progress=lambda n: say(f"{name}: {n:,} records")
            )

    loop = close(on)
    other = loop if against == on else close(against)
    divergence = None if other is loop else parting(filter, loop, other)
    judged = other if on in _FLOATS else loop
    reference = make_level("float", build).run(judged.inputs)
    accuracy = judge(build, 0, judged.inputs, judged.run, reference, judged.clamped)
    if target is not None:
        target.write(content_of(str(output), loop.record(filter, plant.name)))
    float_levels = _FLOATS & {on, against}
    return LoopResult(
        world=plant.name,
        estimator=filter.name,
        on=on,
        against=against,
        good=(divergence is None or bool(float_levels)) and accuracy.good,
        records=len(loop.inputs),
        records_per_s=round(loop.records_per_s),
        parting=None if divergence is None else divergence.line(),
        accuracy=accuracy.differences,
        truth=tuple(differences(filter.outputs, loop.outputs, loop.truth, judged=False)),
        clamped=loop.clamped,
        saturated_updates=accuracy.saturated_updates,
        unused=loop.unused,
        causes=accuracy.causes(),
    )
