"""Records by the million, piece by piece: no more of them at once than one piece."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial

import numpy as np
import numpy.typing as npt

from boresight.model.estimator import Estimator
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Column, Record

__all__ = ["fed"]

FloatArray = npt.NDArray[np.float64]


def fed(
    estimator: Estimator, pieces: Iterable[Mapping[str, FloatArray]], name: str = "stream"
) -> Iterator[FloatArray]:
    """Inputs (n, n_inputs) of pieces, columns (n,) by name, as `feed` has them of one record.

    What is missing is held over the pieces' borders. Each may be given to `Level.run`, which goes
    on where the last one stopped.

    Raises
    ------
    InputError
        See `feed`; there is no ``t``, so a ``dt`` is a column.
    """
    before: dict[str, FloatArray] = {}
    names = [i.name for i in estimator.inputs]
    for number, piece in enumerate(pieces):
        given = {n: piece[n] for n in names if n in piece}
        columns = {n: Column(np.concatenate([before.get(n, v[:0]), v])) for n, v in given.items()}
        where, carried = f"{name}, piece {number}", len(before) > 0
        place = partial(_place, where, carried)
        found = feed(estimator, Record(name, columns, place, where)).inputs
        yield found[carried:]
        before = dict(zip(names, found[-1:].T, strict=True))


def _place(where: str, carried: bool, row: int, column: str) -> str:
    return f"{where}, {column}[{row - carried}]"
