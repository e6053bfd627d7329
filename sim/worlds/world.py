"""Plant models: each maps the last outputs of an estimator to its next record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError, require
from boresight.model.resolve import load, names_of_entry_points
from boresight.model.step import called

#: Entry points of installed packages that are worlds.
WORLD_GROUP = "boresight.worlds"


class World:
    """Base class of plant models.

    A subclass has `record`, which maps the last outputs to the next record, or `pieces` if it
    ignores the outputs. It is deterministic: after `start` the same outputs give the same records,
    bit by bit, so that forms can be compared.
    """

    #: By default the class's name in lower case.
    name: str = "world"
    #: Number of runs of a batched plant. Its values, and the outputs that it gets, are arrays
    #: (runs,) in place of numbers; an array of one element holds for all runs.
    runs: int | None = None

    def __init_subclass__(cls) -> None:
        if "name" not in vars(cls):
            cls.name = cls.__name__.lower()

    def start(self) -> None:
        """Reset the world to its start."""

    def record(self, outputs: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
        """The next record: values by input name, in the inputs' units; None at the end.

        NaN is no new sample; truths may stand under ``NAME_true``. ``outputs`` are the estimator's
        for the last record, by name, in their units; None before the first.
        """
        raise NotImplementedError

    def pieces(self) -> Iterator[Mapping[str, FloatArray]] | None:
        """All records of a world without feedback, from the start on, in pieces of any length.

        Each piece has columns (n,) by name, as in `record`; of a batched plant (n, runs), or (n,)
        of all runs. None: the world is asked for each `record`.
        """
        return None

    def draw(self, seed: int) -> None:
        """Select the random values of the next run by ``seed``.

        `start` follows: store the seed here, and create generators from it there. Raises
        InputError where the world has no draws.
        """
        fix = "write draw(self, seed), which stores the seed for the noise of start"
        where, found = f"world {self.name}", f"none for seed {seed}"
        raise InputError.at(where, wanted="a world with draws", found=found, fix=fix)

    def bound(self) -> Mapping[str, FloatArray]:
        """Lower bounds of the standard deviation (records,), by output name."""
        return {}


class BatchedWorld(World):
    """A batched plant with a run for each of ``seeds``; a draw is one run."""

    def __init__(self, seeds: Sequence[int]) -> None:
        self.seeds = tuple(seeds)
        self.runs: int = len(self.seeds)

    def draw(self, seed: int) -> None:
        self.seeds, self.runs = (seed,), 1


def drawn(world: World, seed: int) -> None:
    """Let a world take a draw (`World.draw`); its exceptions become one line."""
    where = f"world {world.name}, draw"
    called(world.draw, seed, where=where, wanted=f"a draw of seed {seed}", fix="correct the world")


def bound_of(world: World, records: int) -> dict[str, FloatArray]:
    """The least standard deviations of a world (`World.bound`), by output, checked."""
    where = f"world {world.name}, bound"
    wanted = f"standard deviations of {records} records by output name"
    fix = "return {NAME: an array with a number for each record}"
    result: Any = called(
        world.bound, where=where, wanted=wanted, fix="correct the world", kind=Mapping, answer=fix
    )
    bound = {}
    for name, values in result.items():
        try:
            bound[name] = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            found = f"a {type(values).__name__} of {name} that holds no numbers"
            raise InputError.at(where, wanted=wanted, found=found, fix=fix) from None
        shape = bound[name].shape
        good = len(shape) == 1 and shape[0] >= records
        require(good, where, wanted, f"the shape {shape} of {name}", fix)
    return bound


#: Reference to a world: a text, a class or an object.
NamedWorld: TypeAlias = str | type[World] | World


def is_world(source: Any) -> bool:
    """Whether a source is a world: an object, a class, a file of Python, or an installed name."""
    if isinstance(source, str):
        stem, colon, _ = source.partition(".py:")
        name = stem.partition("(")[0]
        return bool(colon) or source.endswith(".py") or name in names_of_entry_points(WORLD_GROUP)
    return isinstance(source, World) or (isinstance(source, type) and issubclass(source, World))


def world_of(source: NamedWorld) -> World:
    """The world of a name, class or object; see `model.resolve.load`."""
    return load(source, World, "world", WORLD_GROUP)
