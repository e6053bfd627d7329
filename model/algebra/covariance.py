"""Covariances of Kalman filters on lists of scalars: the same code on floats and on the tracer.

A symmetric matrix is a full list of lists in which both halves hold the same scalars, so it is
symmetric by construction and every element is computed once. Why this form and these scales:
`docs/systems/ekf.md`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from boresight.model import ops
from boresight.model.algebra.quaternion import Matrix, dot
from boresight.model.estimator import State

Symmetric = list[list[Any]]

#: Bound of scaled covariances: below one, so that words need no bit for the value one.
BELOW_ONE = 1.0 - 2.0**-17
#: When elements leave the bounds of a covariance, as rounding and large corrections can make it.
NO_COVARIANCE = "P is indefinite or its trace larger"


def symmetric(n: int, element: Callable[[int, int], Any]) -> Symmetric:
    """The matrix whose element (i, j), i <= j, is ``element(i, j)``."""
    p: Symmetric = [[None] * n for _ in range(n)]
    for i in range(n):
        for j in range(i, n):
            p[i][j] = p[j][i] = element(i, j)
    return p


def element_names(n: int) -> list[tuple[str, int, int]]:
    """(name, i, j) of the stored elements, i <= j; state numbers from ten on are letters."""
    digits = "0123456789abcdefghijklmnopqrstuvwxyz"
    return [(f"p{digits[i]}{digits[j]}", i, j) for i in range(n) for j in range(i, n)]


def covariance_states(n: int, initial: Callable[[int], float]) -> tuple[State, ...]:
    """States of a scaled covariance of order n; ``initial(i)`` is variance i."""
    return tuple(
        State(name, 0.0 if i == j else -BELOW_ONE, BELOW_ONE, "", initial(i) if i == j else 0.0)
        for name, i, j in element_names(n)
    )


def covariance_of(x: Any, n: int) -> Symmetric:
    """The covariance among the states ``x``."""
    names = {(i, j): name for name, i, j in element_names(n)}
    return symmetric(n, lambda i, j: getattr(x, names[i, j]))


def bounded_element(value: Any, i: int, j: int) -> Any:
    """An element of a scaled covariance: its trace is at most one."""
    return part(value, "covariance of trace below one", 0.0 if i == j else -BELOW_ONE)


def part(value: Any, reason: str = "part of P", low: float = -BELOW_ONE) -> Any:
    """A value no larger than an element of a scaled covariance."""
    return ops.bounded(value, low, BELOW_ONE, reason, unless=NO_COVARIANCE)


def congruence(m: Matrix, p: Symmetric, name: Callable[[int, int, Any], Any]) -> Symmetric:
    """M^T P M; n^3 slots for P M and (n^3 + n^2)/2 for the upper half of the result.

    ``name(i, j, value)`` gives each element of the result its range.
    """
    n = len(p)
    reason = "part of a rotated covariance"
    columns = [[m[k][j] for k in range(n)] for j in range(n)]
    pm = [[part(dot(p[i], columns[j]), reason) for j in range(n)] for i in range(n)]
    return symmetric(n, lambda i, j: name(i, j, dot(columns[i], [pm[k][j] for k in range(n)])))


def partly_turned(m: Matrix, p: Symmetric, name: Callable[[int, int, Any], Any]) -> Symmetric:
    """diag(M, 1)^T P diag(M, 1), M of the order of the leading states; see `congruence`."""
    n = len(m)
    leading = congruence(m, [row[:n] for row in p[:n]], name)

    def element(i: int, j: int) -> Any:
        if j < n:
            return leading[i][j]
        if i >= n:
            return name(i, j, p[i][j])
        return name(i, j, dot([row[i] for row in m], [p[k][j] for k in range(n)]))

    return symmetric(len(p), element)


def sheared(p: Symmetric, rows: Mapping[int, Mapping[int, Any]]) -> Symmetric:
    """Phi P Phi^T where some states move by others that are constant.

    x_i += sum_j rows[i][j] x_j, no j among the i: 1 + m_i slots for an element in one of those
    rows of m_i entries, 1 + m_i + m_j in two.
    """

    def moved(i: int, j: int) -> Any:
        return p[i][j] + dot(list(rows[i].values()), [p[k][j] for k in rows[i]])

    across = {(i, j): part(moved(i, j)) for i in rows for j in range(len(p)) if j not in rows}

    def element(i: int, j: int) -> Any:
        if i in rows and j in rows:
            value = moved(i, j) + dot(list(rows[j].values()), [across[i, k] for k in rows[j]])
            return bounded_element(value, i, j)
        return across[i, j] if i in rows else across[j, i] if j in rows else p[i][j]

    return symmetric(len(p), element)


def updated_column(p: Symmetric, c: int, gains: list[list[Any]]) -> list[Any]:
    """Column c of P - sum_k L_k L_k^T without computing the rest: n (1 + k) slots."""
    if not gains:
        return list(p[c])
    return [bounded_element(p[i][c] - _products(gains, i, c), i, c) for i in range(len(p))]


def downdated(p: Symmetric, gains: list[list[Any]], skip: Any) -> Symmetric:
    """P - sum_k L_k L_k^T, or P where ``skip`` holds: (1 + k) slots per stored element."""
    return symmetric(
        len(p),
        lambda i, j: bounded_element(p[i][j] - ops.where(skip, 0.0, _products(gains, i, j)), i, j),
    )


def reduced(p: Symmetric, gain: list[Any]) -> Symmetric:
    """P - L L^T of a single update: two slots per stored element."""
    return symmetric(len(p), lambda i, j: bounded_element(p[i][j] - gain[i] * gain[j], i, j))


def _products(gains: list[list[Any]], i: int, j: int) -> Any:
    """sum_k L_ki L_kj. Sums of two and more are words that columns share."""
    total: Any = 0.0
    for k, column in enumerate(gains):
        total = total + column[i] * column[j]
        if k == 1:
            total = part(total, low=0.0 if i == j else -BELOW_ONE)
    return total
