"""Plant models: each maps the last outputs of an estimator to its next record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from boresight.model.arrays import FloatArray
from boresight.model.errors import InputError
from boresight.model.resolve import load

__all__ = ["WORLD_GROUP", "NamedWorld", "World", "world_of"]

#: Entry points of installed packages that are worlds.
WORLD_GROUP = "boresight.worlds"


class World:
    """Base class of plant models.

    A world gives records to an estimator and gets its outputs: it has `record`, or `pieces` if it
    ignores the outputs. It is deterministic: after `start` the same outputs give the same records,
    bit by bit, so that levels can be compared.

    Attributes
    ----------
    name : str
        By default the class's name in lower case.
    runs : int or None
        Of a batched plant, which simulates several runs at once: how many. Its values, and the
        outputs that it gets, are arrays (runs,) in place of numbers; a value of one element is that
        of all runs.
    """

    name: str = "world"
    runs: int | None = None

    def __init_subclass__(cls) -> None:
        if "name" not in vars(cls):
            cls.name = cls.__name__.lower()

    def start(self) -> None:
        """Begin anew: whatever the world remembers goes back to its start."""

    def record(self, outputs: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
        """The next record.

        Parameters
        ----------
        outputs : mapping of str to float, or None
            The estimator's outputs for the last record, by name, in the outputs' units; None before
            the first.

        Returns
        -------
        mapping of str to float, or None
            Values by input name, in the inputs' units (NaN: no new sample), and perhaps truths
            under ``NAME_true``; None when the world has come to its end.
        """
        raise NotImplementedError

    def pieces(self) -> Iterator[Mapping[str, FloatArray]] | None:
        """All records of a world without feedback, from the start on, in pieces of any length.

        Returns
        -------
        iterator of mapping of str to float64 (n,), or None
            Columns by name, as in `record`; of a batched plant (n, runs), or (n,) of all runs.
            None: the world is asked for each `record`.
        """
        return None

    def draw(self, seed: int) -> None:
        """Take another draw of what is random, noise and errors: each ``seed`` its own.

        Raises
        ------
        InputError
            The world has no draws.
        """
        raise InputError.at(
            f"world {self.name}",
            wanted="a world with draws",
            found=f"none for seed {seed}",
            fix="write draw(self, seed), which makes its noise anew",
        )

    def bound(self) -> Mapping[str, FloatArray]:
        """Standard deviations (records,) that no estimator can beat, by output name; of any."""
        return {}


#: What stands for a world: a text, a class or an object.
NamedWorld: TypeAlias = str | type[World] | World


def world_of(what: NamedWorld) -> World:
    """The world that is meant; see `model.resolve.load`."""
    return load(what, World, "world", {}, WORLD_GROUP)
