"""What a world is: it is asked for the next record and told the last outputs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError

__all__ = ["Played", "Streamed", "World"]


class World:
    """Base class of closed loops.

    A world gives records to an estimator and hears what it answered. It is deterministic: after
    `start` the same answers give the same records, bit by bit, so that levels can be compared.

    Attributes
    ----------
    name : str
        By default the class's name in lower case.
    """

    name: str = "world"

    def __init_subclass__(cls) -> None:
        if "name" not in vars(cls):
            cls.name = cls.__name__.lower()

    def start(self) -> None:
        """Begin anew: whatever the world remembers goes back to its start."""

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record.

        Parameters
        ----------
        outputs : mapping of str to float, or None
            What the estimator answered to the last record, by output name, in the outputs' units;
            None before the first.

        Returns
        -------
        mapping of str to float, or None
            Values by input name, in the inputs' units (NaN: no new sample), and perhaps truths
            under ``NAME_true``; None when the world has come to its end.
        """
        raise NotImplementedError

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

    def bound(self) -> Mapping[str, npt.NDArray[np.float64]]:
        """Standard deviations (records,) that no estimator can beat, by output name; of any."""
        return {}


class Played(World):
    """A world that hears nothing: records that are there, one after the other."""

    def __init__(self, records: Sequence[Mapping[str, float]]) -> None:
        self.records = records

    def start(self) -> None:
        """Begin anew."""
        self._left = iter(self.records)

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record; see `World`."""
        return next(self._left, None)


class Streamed(World):
    """A world that hears nothing, of very many records: it makes them piece by piece, as arrays."""

    def pieces(self) -> Iterator[Mapping[str, npt.NDArray[np.float64]]]:
        """All records from the start on: columns (n,) by name, as in `World.record`."""
        raise NotImplementedError

    def start(self) -> None:
        """Begin anew."""
        self._rows = self._each()

    def _each(self) -> Iterator[Mapping[str, float]]:
        for piece in self.pieces():
            for row in np.stack([*piece.values()], axis=1).tolist():
                yield dict(zip(piece, row, strict=True))

    def record(self, outputs: Mapping[str, float] | None) -> Mapping[str, float] | None:
        """The next record; see `World`."""
        return next(self._rows, None)
