"""Targets of the three angles, and their bands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from boresight.sim.attitude.ma2014.paper import AXES
from boresight.sim.experiments.experiment import Target

__all__ = ["Band", "around", "below", "each"]

#: Least and greatest good value for each axis; None: no limit.
Band = Sequence[tuple[float | None, float | None]]


def each(
    name: str,
    source: str,
    ours: Sequence[float],
    band: Band,
    *,
    unit: str = "deg",
    axes: Sequence[str] = AXES,
    spread: Mapping[str, Any] | None = None,
    note: str = "",
    binding: bool = False,
    needs: str = "",
    **beside: Sequence[float] | None,
) -> Iterator[Target]:
    """A target for each axis; of values for more axes the last ones count.

    ``spread``: p05 and p95; ``beside``: what the paper prints, what the prototype measured.
    """
    for k in range(-len(axes), 0):
        yield Target(
            name=name,
            source=source,
            part=axes[k],
            value=ours[k],
            low=band[k][0],
            high=band[k][1],
            unit=unit,
            binding=binding,
            needs=needs,
            beside={origin: values[k] for origin, values in beside.items() if values is not None},
            spread=None if spread is None else (spread["p05"][k], spread["p95"][k]),
            note=note,
        )


def around(values: Sequence[float], low: float = 0.9, high: float = 1.1) -> Band:
    """From a share of each value to another, 10 % off by default."""
    return [(low * x, high * x) for x in values]


def below(limits: Sequence[float | None]) -> Band:
    """No more than each limit."""
    return [(None, x) for x in limits]
