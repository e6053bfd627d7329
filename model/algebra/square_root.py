"""Kalman updates of a square root of the covariance, P = S S^T, on lists of scalars.

Every word is at most one: innovations are whitened, and S is over the root of the first covariance,
so that its first value is the identity. So no covariance is too wide for the words.

* `whitened`: Gram-Schmidt on the rows of H where R = H H^T (biases seen in the units of the noise
  that the same instruments have): the rows become orthonormal, the noise white. Unlike a Cholesky
  factor of R it never subtracts squares.
* `potter`: Potter's update (Battin, Astronautical Guidance, 1964; Bierman, Factorization Methods,
  1977, II.6), one row a after the other, of noise variance one::

      f = S^T a    w = 1/sqrt(1 + f.f)    psi = f w/sqrt(1 + w)      |psi|^2 = 1 - w
      S <- S (1 - psi psi^T)    x <- x + (S psi) sqrt(1 + w) w (y - a.x)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.algebra.carried import BELOW
from boresight.model.algebra.quaternion import Matrix, Vector, dot


def whitened(
    rows: Matrix, values: Vector, longest: float, reach: float
) -> tuple[list[list[Any]], list[Any]]:
    """Orthonormal rows A = L^-1 H and L^-1 z, where H H^T = L L^T.

    ``rows`` H (m, n) are up to ``longest``; the remainder of a row counts as at least 2^-11 of
    that. ``values`` z (m,), in the unit of H's rows, are clamped to ``reach``, a power of two.
    """
    unit_rows: list[list[Any]] = []
    white: list[Any] = []
    for row, value in zip(rows, values, strict=True):
        # Modified Gram-Schmidt: remainder of the row after each earlier one.
        for unit, white_value in zip(unit_rows, white, strict=True):
            along = ops.bounded(dot(row, unit), -longest, longest, "component of a row")
            rest = (c - along * u for c, u in zip(row, unit, strict=True))
            row = [ops.bounded(c, -longest, longest, "rest of a row") for c in rest]
            value = ops.saturated(value - along * white_value, reach)
        square = ops.bounded(dot(row, row), 0.0, longest * longest, "square of a row")
        inverse = ops.rsqrt(square)
        unit_rows.append([ops.bounded(c * inverse, -1.0, BELOW, "of a unit vector") for c in row])
        white.append(ops.saturated(value * inverse, MOST_WHITE))
    return unit_rows, white


MOST_WHITE = 2.0**6  #: largest innovation over its noise.
MOST_NORMAL = 2.0**4  #: the same over its standard deviation.
WIDE = 2.0**3  #: words of S^T a; a row whose f.f passes half its square is not used.


@dataclass(frozen=True)
class Potter:
    """Result of `potter`.

    ``root`` S (n, n); ``moves`` (n,), factors whose products move the state (`algebra.carried`);
    ``white`` (m,), innovations over their standard deviations; ``wide``: a row was not used, P
    being too wide along it.
    """

    root: list[list[Any]]
    moves: list[list[tuple[Any, Any]]]
    white: list[Any]
    wide: Any


def potter(root: Matrix, rows: Matrix, values: Vector, live: Any, begin: Any) -> Potter:
    """Update by innovations ``values`` along ``rows``, of noise variance one, where ``live`` holds.

    A row along which P is more than ``WIDE**2 / 2`` changes nothing: give it less weight the next
    time (rows and values less, which is more noise), and more of it afterwards. ``root`` S (n, n)
    has elements of at most one; ``rows`` (m, n) are those of the measurements, a; ``values`` (m,)
    y - a.x of the state before. Where ``begin`` holds S becomes the identity.
    """
    n = len(root)
    columns = [[row[j] for row in root] for j in range(n)]
    psis, weights, white, wide = list[list[Any]](), list[Any](), list[Any](), None
    for a, nu in zip(rows, values, strict=True):
        f = [ops.saturated(dot(c, a), WIDE) for c in columns]
        for psi, weight in zip(psis, weights, strict=True):
            along = ops.saturated(dot(psi, f), 2.0 * WIDE)
            f = [ops.saturated(c - along * p, WIDE) for c, p in zip(f, psi, strict=True)]
            nu = nu - along * weight
        square = ops.saturated(dot(f, f), WIDE * WIDE)
        too_wide = square > 0.5 * WIDE * WIDE
        wide = too_wide if wide is None else wide | too_wide
        # For rows in use; for others any finite weight serves.
        w = ops.bounded(ops.rsqrt(1.0 + square), 0.1, 1.0, "inverse of one and more")
        one_plus_w = 1.0 + w
        inverse_root = ops.rsqrt(one_plus_w)
        used = live & ~too_wide
        eta = ops.bounded(ops.where(used, w, 0.0) * inverse_root, 0.0, 1.0, "weight")
        psis.append([ops.bounded(c * eta, -1.0, BELOW, "shorter than one") for c in f])
        n_k = ops.saturated(ops.saturated(nu, 2.0 * MOST_WHITE) * w, MOST_NORMAL)
        white.append(n_k)
        scaled = ops.bounded(one_plus_w * inverse_root, 1.0, 1.5, "root of one and w")
        weights.append(ops.saturated(ops.where(used, n_k, 0.0) * scaled, 2.0 * MOST_NORMAL))
    between = {
        (j, k): ops.bounded(dot(psis[j], psis[k]), -1.0, BELOW, "of vectors shorter than one")
        for k in range(len(psis))
        for j in range(k)
    }
    after, moves = [], []
    for i, row in enumerate(root):
        # S_k psi_k of one row, without S_k: each psi acts on the rows that the others left.
        turned: list[Any] = []
        for k, psi in enumerate(psis):
            value = dot(row, psi)
            for j in range(k):
                value = value - turned[j] * between[j, k]
            turned.append(ops.bounded(value, -1.0, BELOW, "of a row shorter than one"))
        reduced = [row[j] - dot(turned, [psi[j] for psi in psis]) for j in range(n)]
        first = [BELOW if j == i else 0.0 for j in range(n)]
        begun = (ops.where(begin, initial, c) for initial, c in zip(first, reduced, strict=True))
        after.append([ops.bounded(c, -1.0, BELOW, "rows only shrink") for c in begun])
        moves.append(list(zip(turned, weights, strict=True)))
    return Potter(after, moves, white, wide)
