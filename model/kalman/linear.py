"""A Kalman filter from the matrices of a linear system, as other packages hold them."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import Input, Output, check_kind
from boresight.model.errors import InputError, author_line, placed, require
from boresight.model.kalman.declared import Measurement, State
from boresight.model.kalman.kalman import Kalman
from boresight.model.words.rounded import sum_of

#: Most predictions: a covariance may grow without end.
_MOST = 20_000
#: Largest standard deviation over that of the predictions: a variance is held at 3/4 of its bound.
_MARGIN = 1.25
#: Variance of a state whose error grows without end.
_ENDLESS = 1e100

#: Largest values: of each by name, of each in order, or one for all.
Sizes = Mapping[str, float] | Sequence[float] | float


class _Linear(Kalman):
    """x = A x + B u + w, L z = C x + D u + v of independent v."""

    system: tuple[FloatArray, ...]

    def _rows(self, state: FloatArray, drive: FloatArray, x: Any, u: Any) -> list[Any]:
        values = [getattr(x, s.name) for s in self.estimated]
        values += [getattr(u, i.name) for i in self.inputs[: drive.shape[1]]]
        return [
            sum_of(v if a == 1.0 else a * v for a, v in zip(row, values, strict=True) if a)
            for row in np.hstack([state, drive]).tolist()
        ]

    def f(self, x: Any, u: Any, p: Any) -> Mapping[str, Any]:
        """A x + B u."""
        a, b, *_ = self.system
        return dict(zip([s.name for s in self.estimated], self._rows(a, b, x, u), strict=True))

    def noise(self, x: Any, u: Any, p: Any) -> Mapping[Any, Any]:
        """Q."""
        q, names = self.system[4], [s.name for s in self.estimated]
        return {
            names[i] if i == j else (names[i], names[j]): float(q[i, j])
            for i, j in zip(*np.triu_indices(len(q)), strict=True)
            if q[i, j]
        }

    def measure(self, x: Any, u: Any, p: Any) -> Sequence[Measurement]:
        """C x + D u."""
        c, d, _, r, mix = self.system[2:]
        z = [getattr(u, i.name) for i in self.inputs[-len(c) :]]
        mixed = [sum_of(m * v for m, v in zip(row, z, strict=True) if m) for row in mix.tolist()]
        seen = zip(mixed, self._rows(c, d, x, u), r.tolist(), strict=True)
        return [Measurement(value, h, v, line=self._line) for value, h, v in seen]


def linear(
    system: Any,
    *,
    x: Sizes,
    u: Sizes = (),
    z: Sizes | None = None,
    Q: Any = None,
    R: Any = None,
    P: Any = None,
    tolerance: Sizes | None = None,
    sd_max: Sizes | None = None,
    floor: float = Kalman.floor,
    name: str = "Linear",
) -> type[Kalman]:
    """Class of the Kalman filter of a linear, time-discrete system.

    ``x = A x + B u + w``, ``z = C x + D u + v``; the states are the outputs. Its inputs are those
    of the system, then the measurements.

    InputError: a continuous system, matrices that do not fit together, a missing or unsuitable
    covariance.

    Parameters
    ----------
    system : object, or (A, B, C, D)
        With matrices ``A``, ``B``, ``C``, ``D`` and a time step ``dt``, as `scipy.signal.dlti` and
        ``control.ss`` make them; or with ``F``, ``B``, ``H``, ``Q``, ``R``, ``P`` and ``x``, as
        ``filterpy.kalman.KalmanFilter``.
    x, u, z : mapping, sequence or float
        Largest magnitude of each state, input and measurement; a mapping names them, too. By
        default ``z`` follows from those of states, inputs and noise.
    Q, R, P : (n, n), (m, m), (n, n)
        Covariances of w, of v, and of the state at the start. A vector is a diagonal. By default
        those of the object. Measurements with correlated noise are transformed to independent ones.
    tolerance : mapping, sequence or float, optional
        Of each state, as in `Output`.
    sd_max : mapping, sequence or float, optional
        Largest standard deviation of each state; by default it follows from A, C, Q, R and P.
    floor : float
        As in `Kalman`.
    name : str
        Of the class.
    """
    where = placed(author_line(), "kalman.linear")
    check_kind(where, "name", name, "str")
    a, b, c, d = _matrices(system, where)
    n, m, k = len(a), len(c), b.shape[1]
    q, r, p = (
        _covariance(where, letter, getattr(system, letter, None) if given is None else given, size)
        for letter, given, size in (("Q", Q, n), ("R", R, m), ("P", P, n))
    )
    labels = [getattr(system, f"{kind}_labels", None) for kind in ("state", "input", "output")]
    states = _sizes(where, "x", x, n, labels[0])
    driven = _sizes(where, "u", u, k, labels[1])
    sizes = np.array([*states.values(), *driven.values()])
    reach = np.abs(np.hstack([c, d])) @ sizes + 8.0 * np.sqrt(np.diag(r))
    measured = _sizes(where, "z", reach.tolist() if z is None else z, m, labels[2])
    names = [*states]
    accepted: Sequence[float | None] = [None] * n
    if tolerance is not None:
        accepted = _of_states(where, "tolerance", tolerance, names)
    if sd_max is None:
        largest = _largest(where, names, (a, c, q, r, p))
    else:
        largest = _of_states(where, "sd_max", sd_max, names)
    start = np.ravel(getattr(system, "x", np.zeros(n)))
    bounds = zip(np.sqrt(np.diag(p)), largest, strict=True)
    members: dict[str, Any] = {
        "__doc__": f"Kalman filter of {n} states and {m} measurements.",
        "__module__": sys._getframe(1).f_globals["__name__"],
        "floor": floor,
        "system": (a, b, *_independent(c, d, q, r)),
        "initial_covariance": {
            (names[i], names[j]): float(p[i, j]) for i, j in np.ndindex(n, n) if i < j and p[i, j]
        },
        "inputs": tuple(Input(i, -v, v) for i, v in (driven | measured).items()),
        "states": tuple(
            State(s, -v, v, "", float(first), sd=float(sd), sd_max=most)
            for (s, v), first, (sd, most) in zip(states.items(), start, bounds, strict=True)
        ),
        "outputs": tuple(Output(s, tolerance=t) for s, t in zip(names, accepted, strict=True)),
    }
    step = getattr(system, "dt", None)
    if isinstance(step, int | float) and step is not True and step > 0:  # True: unspecified
        members["rates_hz"] = {"dt": 1.0 / step}
    return type(name, (_Linear,), members)


def _matrices(system: Any, where: str) -> tuple[FloatArray, ...]:
    """A, B, C, D as arrays of two dimensions."""
    fixed = isinstance(system, tuple | list) or hasattr(system, "F")
    discrete = fixed or getattr(system, "dt", None) not in (None, 0)
    fix = "sample it: SYSTEM.to_discrete(DT) of scipy, control.sample_system(SYSTEM, DT)"
    require(discrete, where, "a time-discrete system", type(system).__name__, fix)
    if hasattr(system, "F"):
        parts = [system.F, getattr(system, "B", None), system.H]
    elif isinstance(system, tuple | list):
        parts = [*system]
    else:
        parts = [getattr(system, letter, None) for letter in "ABCD"]
    parts += [None] * (4 - len(parts))
    fix = "convert it: SYSTEM.to_ss() of scipy, or control.ss(SYSTEM)"
    whole = parts[0] is not None and parts[2] is not None
    require(whole, where, "matrices A, B, C, D", type(system).__name__, fix)
    for name, plain in (("alpha", 1.0), ("M", 0.0)) if hasattr(system, "F") else ():
        given, fix = getattr(system, name, plain), "write such a filter by its equations"
        require(bool(np.all(given == plain)), f"{where}, {name}", f"{plain:g}", given, fix)
    a, c = (np.atleast_2d(_numbers(where, "A, C", part)) for part in (parts[0], parts[2]))
    n, m = len(a), len(c)
    b = np.zeros((n, 0)) if parts[1] is None else _numbers(where, "B", parts[1])
    b = b.reshape(n, -1) if b.size % max(n, 1) == 0 else np.atleast_2d(b)
    k = b.shape[-1]
    d = np.zeros((m, k)) if parts[3] is None else np.atleast_2d(_numbers(where, "D", parts[3]))
    shapes = [part.shape for part in (a, b, c, d)]
    fits = shapes == [(n, n), (n, k), (m, n), (m, k)]
    require(fits, where, "A (n, n), B (n, k), C (m, n), D (m, k)", shapes)
    return a, b, c, d


def _numbers(where: str, name: str, given: Any) -> FloatArray:
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        place, found = f"{where}, {name}", repr(given)
        raise InputError.at(place, wanted="numbers", found=found, fix="correct it") from None


def _covariance(where: str, name: str, given: Any, n: int) -> FloatArray:
    wanted = f"a symmetric positive matrix ({n}, {n}) or its diagonal"
    place = f"{where}, {name}"
    require(given is not None, place, wanted, given, f"give {name}=")
    matrix = _numbers(where, name, given)
    if matrix.ndim < 2 and matrix.size in (1, n):
        matrix = np.diag(np.broadcast_to(matrix, (n,)))
    good = matrix.shape == (n, n) and np.allclose(matrix, matrix.T)
    good = good and np.linalg.eigvalsh(matrix)[0] >= -1e-12 * np.abs(matrix).max()
    require(bool(good), place, wanted, given)
    if name != "Q":
        fix = "give a larger diagonal, as P=[1.0, 2.0]"
        require(np.linalg.eigvalsh(matrix)[0] > 0.0, place, "a positive matrix", given, fix)
    return matrix


def _independent(c: FloatArray, d: FloatArray, q: FloatArray, r: FloatArray) -> list[FloatArray]:
    """C, D, Q, variances of v, and L: independent sums of the measurements.

    L z = L C x + L D u + L v, with L R L^T diagonal, by Gauss's elimination of R.
    """
    m = len(r)
    rows = np.hstack([r, c, d, np.eye(m)])
    for j in range(m):
        for i in range(j + 1, m):
            rows[i] -= rows[i, j] / rows[j, j] * rows[j]
    variances, c, d, mix = np.split(rows, np.cumsum([m, c.shape[1], d.shape[1]]), axis=1)
    return [c, d, q, np.diag(variances), mix]


def _sizes(
    where: str, name: str, given: Sizes, n: int, labels: Sequence[str] | None
) -> dict[str, float]:
    if isinstance(given, Mapping):
        values = _numbers(where, name, [*given.values()])
        sizes = dict(zip(map(str, given), values.ravel().tolist(), strict=False))
    else:
        values = _numbers(where, name, given)
        values = np.full(n, values) if values.ndim == 0 else values
        good = labels is not None and len(labels) == n and all(map(str.isidentifier, labels))
        # Labels that name nothing: x[0], u[0].
        names = labels if good and labels is not None else [f"{name}{k}" for k in range(n)]
        sizes = dict(zip(names, values.tolist(), strict=True)) if values.shape == (n,) else {}
    fits = len(sizes) == n and all(0.0 < v < math.inf for v in sizes.values())
    require(fits, f"{where}, {name}", f"{n} largest magnitudes above 0", given)
    return sizes


def _of_states(where: str, name: str, given: Sizes, states: Sequence[str]) -> list[float]:
    sizes = _sizes(where, name, given, len(states), states)
    wanted = f"a value of each state: {', '.join(states)}"
    require({*sizes} == {*states}, f"{where}, {name}", wanted, ", ".join(sizes))
    return [sizes[state] for state in states]


def _largest(where: str, names: Sequence[str], matrices: Sequence[FloatArray]) -> Any:
    """Largest standard deviation of each state, of A, C, Q, R, P from the start on."""
    a, c, q, r, p = matrices
    largest = np.diag(p).copy()
    for _ in range(_MOST):
        before = p
        p = a @ p @ a.T + q
        endless = ", ".join(n for n, v in zip(names, np.diag(p), strict=True) if v > _ENDLESS)
        fix = "measure it, or leave it out"
        require(not endless, where, "measurements that bound every error", endless, fix)
        grown = np.maximum(largest, np.diag(p))
        gain = np.linalg.solve(c @ p @ c.T + r, c @ p).T
        p = p - gain @ c @ p
        if (grown == largest).all() and np.allclose(p, before, rtol=1e-9, atol=0.0):
            break
        largest = grown
    # Three digits: the same on every machine.
    return [float(f"{_MARGIN * math.sqrt(v):.3g}") for v in largest]
