"""One scalar measurement of a scaled covariance, with a gate; see `model.algebra.covariance`.

L = P h/sqrt(s), s = h.P h + R, x += L z/sqrt(s), P -= L L^T. A row of zeros changes nothing: rows
that are measured in turn, in different samples, share one update.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import BELOW_ONE, Symmetric, bounded_element, symmetric
from boresight.model.algebra.quaternion import dot

MOVE_LIMIT = 128.0  #: largest innovation over its standard deviation.


@dataclass(frozen=True)
class Measured:
    """Scaled: row by state, at most of unit length; innovation, up to 8; variance R, up to 2."""

    row: Mapping[int, Any]
    innovation: Any
    variance: Any


@dataclass(frozen=True)
class Update:
    """``gain`` L, ``move`` z/sqrt(s); ``beyond``: move outside the gate, both are zero."""

    gain: list[Any]
    move: Any
    beyond: Any


def updated(p: Symmetric, measured: Measured, gate: Any) -> Update:
    """Update by one measurement; ``gate``: largest move; from `MOVE_LIMIT` on no gate."""
    row = measured.row
    products = (dot(list(row.values()), [p[k][i] for k in row]) for i in range(len(p)))
    column = [ops.bounded(c, -BELOW_ONE, BELOW_ONE, "P h") for c in products]
    s = dot(list(row.values()), [column[k] for k in row]) + measured.variance
    weight = ops.rsqrt(ops.bounded(s, 0.0, 3.0, "P + R"))
    move = ops.saturated(ops.saturated(measured.innovation, 8.0) * weight, MOVE_LIMIT)
    beyond = ops.absolute(move) > gate
    reason, gains = "root of a variance", (ops.where(beyond, 0.0, c) * weight for c in column)
    gain = [ops.bounded(g, -BELOW_ONE, BELOW_ONE, reason) for g in gains]
    return Update(gain, ops.where(beyond, 0.0, move), beyond)


def kept(p: Symmetric, keep: Callable[[int, int], Any]) -> Symmetric:
    """P, whose elements count as 0 where their condition ``keep`` fails, before the update."""
    return symmetric(len(p), lambda i, j: ops.where(keep(i, j), p[i][j], 0.0))


def lowered(p: Symmetric, update: Update, more: Sequence[Any]) -> Symmetric:
    """P - L L^T + diag(more)."""

    def element(i: int, j: int) -> Any:
        value = p[i][j] - update.gain[i] * update.gain[j]
        return bounded_element(value + more[i] if i == j else value, i, j)

    return symmetric(len(p), element)
