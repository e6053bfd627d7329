"""The same filter as in a textbook, in float64, to compare a derived one with.

Jacobians are differences of f and h themselves, five points each; all measurements of an update are
taken at once, and P is updated in Joseph's form. With the derivation it shares only the author's
methods and the definition of an attitude's error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from copy import copy
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from boresight.model import ops
from boresight.model.algebra import quaternion
from boresight.model.arrays import BoolArray, FloatArray, is_held
from boresight.model.errors import placed
from boresight.model.estimator import SecondForm
from boresight.model.kalman.declared import (
    RESERVE,
    Attitude,
    Measurement,
    exponent,
    grouped,
    spread,
    upwards,
)
from boresight.model.kalman.slopes import AttitudeView
from boresight.model.kalman.update import MOST_SD, inputs_of, measurements_of, moved, noise_of
from boresight.model.lowering.graph import Intervals
from boresight.model.lowering.trace import Scalar, Trace, Tracer
from boresight.model.recorded import evaluate
from boresight.model.step import Values
from boresight.model.units import UnitError, linear

if TYPE_CHECKING:
    from boresight.model.kalman.kalman import Kalman

#: Step of a difference, as a share of the largest standard deviation.
_STEP = 2.0**-10
#: Information that counts as none, as a share of that of the largest standard deviation.
_UNSEEN = 1e-6
#: Share of updates without a new value from which on an input counts as held.
_HELD = 0.5
#: Largest share by which a rate may change in an update in which it tells the time step.
_CONSTANT = 0.25
#: Largest share of the declared process noise that floor may add without a remark.
_MOST_FLOOR = 0.1
#: Root of the most information about a direction that one update has.
_MOST = 1e4
#: f'(x) h = sum weight_k f(x + k h), to the fourth order.
_STENCIL = {-2: 1.0 / 12.0, -1: -2.0 / 3.0, 1: 2.0 / 3.0, 2: -1.0 / 12.0}


class _Function:
    """A method of the author's on numbers: what ``record`` returns, by name, of its leaves.

    The leaf ``NAME estimate`` of an attitude's component is that of the state estimate, where the
    component itself is varied.
    """

    def __init__(self, kalman: Kalman, record: Any) -> None:
        tracer = Tracer(kalman.name)

        def leaves(kind: str, declared: Any) -> dict[str, Scalar]:
            return {d.name: tracer.leaf(kind, d.name, d.low, d.high, d.unit) for d in declared}

        x = leaves("state", kalman.states)
        u, p = leaves("input", kalman.inputs), leaves("param", kalman.params)
        states = grouped([*kalman.states], Values("state", x))
        for s in kalman.estimated:
            if isinstance(s, Attitude):
                estimate = [tracer.leaf("state", f"{c} estimate", -1.0, 1.0) for c in s.components]
                q = [x[c] for c in s.components]
                states[s.name] = AttitudeView(tracer, q, estimate=estimate)
        inputs = Values("input", grouped(kalman.inputs, Values("input", u)))
        results = record(Values("state", states), inputs, Values("parameter", p))
        self.trace = Trace(tracer, [], {k: tracer.lift(v) for k, v in results.items()})

    def __call__(self, leaves: Mapping[tuple[str, str], Any]) -> dict[str, Any]:
        values = evaluate(self.trace, leaves)
        return {name: values[e.number] for name, e in self.trace.outputs.items()}


class Textbook:
    """An extended Kalman filter of the model of ``kalman``, as in a textbook.

    ``floor``: whether it has the noise that `Kalman.floor` adds for the rounding of P, too.
    """

    def __init__(self, kalman: Kalman, *, floor: bool = False) -> None:
        self.kalman, self.floor = kalman, floor
        self.measurements: list[Measurement] = []
        self._next = _Function(kalman, self._motion)
        self._noise = _Function(kalman, self._variances)
        self._measurement = _Function(kalman, self._measured)
        self._shown = _Function(kalman, kalman.shown)
        self._angles = {s.name for s in kalman.states if s.unit == "ht"}
        self._begin()

    def _begin(self) -> None:
        measurements, errors = len(self.measurements), len(self.kalman.errors)
        #: Of each update, whether each measurement was valid.
        self._valid: list[BoolArray] = []
        #: Of each error state, updates in which its variance was near its largest, and its process
        #: noise in all updates.
        self._held, self._noise_sum = np.zeros(errors, dtype=int), np.zeros(errors)
        #: Of each measurement, updates in which its innovation was beyond `MOST_SD`.
        self._limited = np.zeros(measurements, dtype=int)
        #: Of each measurement and error state, the largest derivative over `slope_max`.
        self._steepest = np.zeros((measurements, errors))
        #: Of each update: F, and the rows of H over the deviations of their noise.
        self._moves: list[FloatArray] = []
        self._seen: list[FloatArray] = []

    # -- what the author wrote, as functions ----------------------------------------------------

    def _motion(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        k = self.kalman
        return moved(k, k.f(x, u, p), {s.name: getattr(x, s.name) for s in k.states})

    def _variances(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        k = self.kalman
        intervals = Intervals(getattr(x, k.states[-1].name).tracer)
        return {f"{i} {j}": v for (i, j), v in noise_of(k, k.noise(x, u, p), intervals).items()}

    def _measured(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        self.measurements = measurements_of(self.kalman, x, u, p)
        #: Of each measurement: inputs that it reads, and flags of those that z reads, by input,
        #: where it reads none of these flags.
        self._read = [inputs_of(m.z, m.h, m.r, m.valid) for m in self.measurements]
        self._unread: list[dict[str, str]] = []
        self._slope_max = np.full((len(self.measurements), len(self.kalman.errors)), np.inf)
        for limits, m in zip(self._slope_max, self.measurements, strict=True):
            stated = spread(m.slope_max, self.kalman.groups, m.line, "slope_max")
            for name, limit in stated.items():
                limits[self.kalman.errors.index(name)] = limit
        flags = {name: i.name for i in self.kalman.inputs for name in i.flags}
        out: dict[str, Any] = {}
        for n, m in enumerate(self.measurements):
            measured = {name: flags[name] for name in inputs_of(m.z) if name in flags}
            self._unread.append({} if {*measured.values()} & self._read[n] else measured)
            out[f"valid {n}"] = 1.0 if m.valid is None else ops.where(m.valid, 1.0, 0.0)
            out |= {f"excess {n}": m.h - m.z, f"r {n}": m.r}
        return out

    # -- the filter -----------------------------------------------------------------------------

    def run(self, inputs: FloatArray, params: Mapping[str, float] | None = None) -> SecondForm:
        """Run it on inputs (n, n_inputs) in their units, and tell what that shows of the model."""
        k = self.kalman
        self._begin()
        x = {s.name: np.float64(s.initial) for s in k.states}
        cov = np.empty((len(k.errors),) * 2)
        for name, (i, j) in k.covariance_states.items():
            cov[i, j] = cov[j, i] = x[name]
        fixed = {("param", name): v for name, v in k.param_values(params).items()}
        first, rows, covariances = cov.copy(), [], []
        for record in inputs:
            leaves = fixed | {("input", i.name): v for i, v in zip(k.inputs, record, strict=True)}
            x, cov = self._predicted(x, cov, leaves)
            prior = x = self._with_covariance(x, cov)
            x, cov, nis = self._corrected(x, cov, leaves)
            valid, accepted = int(self._valid[-1].sum()), len(self._seen[-1])
            counts = {"nis": nis, "accepted": accepted, "rejected": valid - accepted}
            x = self._with_covariance(x, cov)
            shown = prior if k.prior else x
            values = {**shown, **counts, **self._shown(self._leaves(shown, leaves))}
            rows.append([float(values[o.name]) for o in k.outputs])
            covariances.append(cov)
        outputs = {o.name: c for o, c in zip(k.outputs, np.array(rows).T, strict=True)}
        unseen = _unseen(self._moves, self._seen, np.array(k.largest_sd))
        variances = np.diagonal([first, *covariances], axis1=1, axis2=2).max(axis=0)
        if self._held.any():
            free = copy(k)
            free.variance_limits = [math.inf] * len(k.errors)
            found = Textbook(free, floor=self.floor).run(inputs, params).covariances
            assert found is not None
            variances = np.maximum(variances, np.diagonal(found, axis1=1, axis2=2).max(axis=0))
        never = np.flatnonzero(~np.any(self._valid, axis=0)).tolist()

        def absent(later: FloatArray) -> list[str]:
            columns = zip(k.inputs, later.T, strict=True)
            after = self._leaves(x, fixed | {("input", i.name): v for i, v in columns})
            return [*self._absences(len(inputs), unseen, never, len(later), after)]

        return SecondForm(
            outputs,
            [*self._remarks(len(inputs), unseen, np.sqrt(variances))],
            [*self._faults(inputs)],
            {} if any(i.name == "dt" for i in k.inputs) else self._time_steps(),
            covariances=np.array(covariances),
            absent=absent,
        )

    def _faults(self, inputs: FloatArray) -> Iterator[tuple[str, str]]:
        """Faults of the measurements in a run, each with its kind."""
        flagged = {name for i in self.kalman.inputs for name in i.flags}
        columns = [*enumerate(self.kalman.inputs)]
        for n, m in enumerate(self.measurements):
            subject, flags = placed(m.line, "measurement"), self._unread[n]
            taken = inputs[[valid[n] for valid in self._valid]]
            unread = [at for at, i in columns if i.name in flags.values()]
            if old := np.count_nonzero((taken[:, unread] < 0.5).any(axis=1)):
                yield (
                    "hold",
                    f"{subject}: taken in {old} of {len(inputs)} updates without a new "
                    f"sample of {' or '.join(flags)}; leave these out by "
                    f"valid=u.{next(iter(flags.values()))} > 0.5",
                )
            # A flag that r reads, say, leaves samples out, too.
            read = [at for at, i in columns if i.flags and i.name in self._read[n]]
            taken = taken[(taken[:, read] >= 0.5).all(axis=1)]
            for at, i in columns if len(taken) > 1 else ():
                holds = i.missing == "hold" and i.name not in flagged and i.name in inputs_of(m.z)
                share = np.mean(np.diff(taken[:, at]) == 0.0)
                if holds and share >= _HELD and is_held(taken[:, [at]], few=True):
                    yield (
                        "hold",
                        f"{subject}: {i.name} holds its last sample in {share:.0%} of the updates "
                        "that take it, and each is taken as a new one; declare an input with "
                        f'valid_of="{i.name}", and give it to valid',
                    )

    def _time_steps(self) -> dict[str, tuple[float, float]]:
        """Means of the derivatives of states by their rates, s, by names.

        Each is followed by that of the root of their squares for all that the rate moves: a speed
        along a heading moves two. Left out: of several rates of a state, or of one that changes
        within an update.
        """
        k, slopes = self.kalman, np.array(self._moves)
        scalars = [i for i, name in enumerate(k.errors) if name in k.groups]
        steps: dict[tuple[int, int], FloatArray] = {}
        for i, j in product(scalars, scalars):
            of, by = (k.unit_of(n).replace("degC", "K") for n in (i, j))
            if of and by and of != by and slopes[:, i, j].any():
                with suppress(UnitError):
                    factor, _ = linear(f"{of}/s".replace("/s/s", "/s^2"), by)
                    steps[i, j] = slopes[:, i, j] * factor
        means = {}
        for (i, j), own in steps.items():
            moving = np.count_nonzero([s for (of, _), s in steps.items() if of == i], axis=0)
            if moving.max() == 1 and np.abs(slopes[:, j, j] - 1.0).max() <= _CONSTANT:
                every = np.linalg.norm([s for (_, by), s in steps.items() if by == j], axis=0)
                means[f"{k.errors[i]} by {k.errors[j]}"] = float(own.mean()), float(every.mean())
        return means

    def _remarks(
        self, updates: int, unseen: Sequence[FloatArray], deviations: FloatArray
    ) -> Iterator[str]:
        """Remarks of a run about the model, one line each, with the source location.

        ``deviations`` (errors,) are the largest standard deviations without `sd_max`.
        """
        k = self.kalman
        for m, limited in zip(self.measurements, self._limited, strict=True):
            if limited:
                subject = placed(m.line, "measurement")
                yield (
                    f"{subject}: the innovation is beyond {MOST_SD:g} standard deviations in "
                    f"{limited} of {updates} updates, and limited to these; raise r, sd_max or the "
                    "process noise, or give it a gate (at most 32)"
                )
        for n, i in np.argwhere(self._steepest > 1.0):
            largest, name = self._steepest[n, i], k.errors[i]
            yield (
                f"{placed(self.measurements[n].line, 'measurement')}: the derivative by {name} is "
                f"limited, being up to {largest:.2g} times its slope_max; multiply slope_max of "
                f"{name} by 2**{exponent(largest)}"
            )
        shown = np.all([np.abs(direction) <= 0.05 for direction in unseen], axis=0)
        for i in np.flatnonzero((self._held > 0) & shown):
            yield (
                f"{placed(k.places[i], 'state')}: the variance of {k.errors[i]} is held at its "
                f"largest in {self._held[i]} of {updates} updates; raise sd_max to "
                f"{upwards(RESERVE * deviations[i]):g}"
            )
        noise = self._noise_sum / updates
        if not noise.any():
            yield (
                f"{k.name}: no state has process noise; the gains go to zero, and the filter stops "
                "following its measurements"
            )
        for n, (declared, added) in enumerate(zip(noise, k.noise_floor, strict=True)):
            subject = f"{placed(k.places[n], 'state')}: {k.errors[n]}"
            if not declared and not added:
                yield (
                    f"{subject} has no process noise and floor is 0, so that rounding may make its "
                    "variance negative; give it noise, or a floor"
                )
            elif added > _MOST_FLOOR * declared > 0.0:
                needed, most = upwards(RESERVE * deviations[n]), _MOST_FLOOR * declared / added
                cure = f"lower sd_max to {needed:g}"
                if self._held[n] or needed > math.sqrt(most) * k.largest_sd[n]:
                    power = math.frexp(most * k.floor)[1] - 1
                    cure = f"raise it to {upwards(added / _MOST_FLOOR):g}, or lower floor to "
                    cure += f"2**{power} if check stays good"
                yield (
                    f"{subject} gets {added:.3g} in each update by floor, {added / declared:.0%} "
                    f"of its process noise of {declared:.3g}; {cure}"
                )

    def _absences(
        self,
        updates: int,
        unseen: Sequence[FloatArray],
        never: Sequence[int],
        later: int,
        leaves: Mapping[Any, Any],
    ) -> Iterator[str]:
        """Remarks about measurements that are ``never`` valid, and directions that are ``unseen``.

        ``leaves`` has the inputs (later,) that follow the run: what is valid there may show more.
        """
        k = self.kalman
        measured = self._measurement(leaves) if later and never else {}
        absent = [n for n in never if not np.any(measured.get(f"valid {n}", 0.0) >= 0.5)]
        for n in absent:
            subject = placed(self.measurements[n].line, "measurement")
            yield f"{subject}: not valid in any of {updates + later} updates"
        first = "the first " * bool(later)
        for direction in unseen if len(absent) == len(never) else ():
            at = np.flatnonzero(np.abs(direction) > 0.05)
            change = direction[at] * np.array(k.largest_sd)[at]
            parts = " and ".join(
                f"of {k.errors[i]} by {c:.3g} {k.unit_of(int(i))}".rstrip()
                for i, c in zip(at, change / change[0], strict=True)
            )
            subject = f"a change {parts}" if len(at) > 1 else k.errors[at[0]]
            it = "one of them" if len(at) > 1 else "it"
            yield (
                f"{placed(k.places[at[0]], 'state')}: no measurement of {first}{updates} updates "
                f"shows {subject}; measure {it}, let it move what is measured, or leave it out"
            )

    def _with_covariance(self, x: Mapping[str, Any], cov: FloatArray) -> dict[str, Any]:
        return {**x, **{name: cov[pair] for name, pair in self.kalman.covariance_states.items()}}

    def _leaves(self, x: Mapping[str, Any], leaves: Mapping[Any, Any], estimate: Any = None) -> Any:
        estimate = estimate or x
        values = {("state", name): v for name, v in x.items()}
        for s in self.kalman.estimated:
            if isinstance(s, Attitude):
                values |= {("state", f"{c} estimate"): estimate[c] for c in s.components}
        return {**leaves, **values}

    def _predicted(
        self, x: dict[str, Any], cov: FloatArray, leaves: Mapping[Any, Any]
    ) -> tuple[dict[str, Any], FloatArray]:
        """x = f(x), P = F P F^T + Q."""
        k = self.kalman
        next_x, slope = self._linearised(self._next, k.errors, x, leaves)
        f, q, after = slope.copy(), np.zeros_like(cov), dict(x)
        for s in k.estimated:
            at = k.errors.index(k.groups[s.name][0])
            if isinstance(s, Attitude):
                q_before = [x[c] for c in s.components]
                f[at : at + 3] = np.array(quaternion.matrix(q_before)) @ slope[at : at + 3]
                f[at : at + 3, at : at + 3] += np.eye(3)
                half = 0.5 * np.array([next_x[e] for e in s.errors], dtype=float)
                angle = np.linalg.norm(half)
                dq = np.cos(angle), *(np.sinc(angle / np.pi) * half)
                after |= zip(s.components, _times(q_before, dq), strict=True)
            else:
                after[s.name] = ops.wrap_ht(next_x[s.name]) if s.unit == "ht" else next_x[s.name]
        after |= {s.name: next_x[s.name] for s in k.memory}
        for pair, value in self._noise(self._leaves(x, leaves)).items():
            i, j = map(int, pair.split())
            q[i, j] = q[j, i] = value
        self._noise_sum += np.diag(q)
        q += np.diag(k.noise_floor) * self.floor
        self._moves.append(f.copy())
        is_held = np.diag(cov) > np.array(k.variance_limits)
        self._held += is_held
        f[is_held] = np.eye(len(f))[is_held]
        q[is_held] = q[:, is_held] = 0.0
        return after, f @ cov @ f.T + q

    def _corrected(
        self, x: dict[str, Any], cov: FloatArray, leaves: Mapping[Any, Any]
    ) -> tuple[dict[str, Any], FloatArray, float]:
        """All measurements at once, but for those beyond their gate after the ones before."""
        k = self.kalman
        numbers = range(len(self.measurements))
        excesses = [f"excess {n}" for n in numbers]
        measured, h = self._linearised(self._measurement, excesses, x, leaves)
        r = np.array([float(measured[f"r {n}"]) for n in numbers])
        nu = np.array([-float(measured[f"excess {n}"]) for n in numbers])
        for n, m in enumerate(self.measurements):
            nu[n] = ops.wrap_ht(nu[n]) if m.wrap else nu[n]
        valid = [n for n in numbers if measured[f"valid {n}"] >= 0.5]
        self._valid.append(np.isin(numbers, valid))
        s = h @ cov @ h.T + np.diag(r)
        accepted: list[int] = []
        for n in valid:
            gate = self.measurements[n].gate
            weights = np.linalg.solve(s[np.ix_(accepted, accepted)], s[accepted, n])
            variance, residual = s[n, n] - weights @ s[accepted, n], nu[n] - weights @ nu[accepted]
            if gate is None or residual * residual <= gate**2 * variance:
                accepted.append(n)
                self._limited[n] += residual * residual > MOST_SD**2 * variance
        h, r, nu = h[accepted], r[accepted], nu[accepted]
        s = s[np.ix_(accepted, accepted)]
        self._seen.append(h.reshape(-1, len(cov)) / np.sqrt(r)[:, None])
        shares = np.abs(h) / self._slope_max[accepted]
        self._steepest[accepted] = np.maximum(self._steepest[accepted], shares)
        gain = np.linalg.solve(s, h @ cov).T
        change, complement = gain @ nu, np.eye(len(cov)) - gain @ h
        after = _moved_by(k, x, change)
        joseph = complement @ cov @ complement.T + gain @ np.diag(r) @ gain.T
        return after, joseph, float(nu @ np.linalg.solve(s, nu))

    def _linearised(
        self, function: _Function, names: list[str], x: dict[str, Any], leaves: Mapping[Any, Any]
    ) -> tuple[dict[str, Any], FloatArray]:
        """Values of a function at the estimate, and the derivatives (names, errors) of some."""
        k, n = self.kalman, len(self.kalman.errors)
        steps = np.array(k.largest_sd) * _STEP
        changes = [np.diag(steps * times) for times in _STENCIL]
        change = np.concatenate([*changes, np.zeros((1, n))])  # (4 n + 1, n)
        varied = _moved_by(k, x, change.T)
        for s in k.estimated:
            for name in s.components if isinstance(s, Attitude) else (s.name,):
                varied[name][-1] = x[name]  # without the rounding of the normalisation
        results = function(self._leaves(varied, leaves, estimate=x))
        values = {name: np.broadcast_to(value, len(change)) for name, value in results.items()}
        weights = np.array([*_STENCIL.values()])[:, None] / steps
        rows = []
        for name in names:
            differences = values[name][:-1] - values[name][-1]
            if self._is_angle(name):
                differences = ops.wrap_ht(differences)
            rows.append((differences.reshape(-1, n) * weights).sum(axis=0))
        return {name: value[-1] for name, value in values.items()}, np.array(rows)

    def _is_angle(self, name: str) -> bool:
        """Whether a next state or an expected measurement wraps."""
        if name.startswith("excess "):
            return self.measurements[int(name.removeprefix("excess "))].wrap
        return name in self._angles


def _unseen(
    moves: Sequence[FloatArray], seen_rows: Sequence[FloatArray], sd_max: FloatArray
) -> Sequence[FloatArray]:
    """Directions of which the measurements of a run tell less than `_UNSEEN`: states first.

    ``moves``: F of each update; ``seen_rows``: H over the deviations of its noise. The information
    about the state in one update, in units of the largest deviations, follows backwards from that
    in the next one, H^T R^-1 H + F^T I F. Each root of it is limited to `_MOST`: so a state that
    grows hides no other. Averaged over the updates, a state that decays counts, too. Information 1
    halves the largest variance. None of a run that diverges.
    """
    if not all(np.isfinite(m).all() for m in (*moves, *seen_rows)):
        return []
    n = len(sd_max)
    root, information = np.zeros((0, n)), np.zeros((n, n))
    for f, rows in zip(reversed(moves), reversed(seen_rows), strict=True):
        stacked = np.concatenate([rows * sd_max, root])
        _, sizes, directions = np.linalg.svd(stacked, full_matrices=False)
        root = (sizes / np.hypot(1.0, sizes / _MOST))[:, None] * directions
        root[:, ~stacked.any(axis=0)] = 0.0  # a rounding error there might grow
        information += root.T @ root / len(moves)
        root = root @ (f * sd_max / sd_max[:, None])
    seen = np.diag(information) >= _UNSEEN
    out: list[FloatArray] = [*np.eye(n)[~seen]]
    values, vectors = np.linalg.eigh(information[np.ix_(seen, seen)])
    for vector in vectors.T[values < _UNSEEN]:
        direction = np.zeros(n)
        largest = np.abs(vector).round(6).argmax()  # the first of equals
        direction[seen] = vector * np.sign(vector[largest])
        out.append(direction)
    return out


def _moved_by(kalman: Kalman, x: Mapping[str, Any], change: FloatArray) -> dict[str, Any]:
    """States moved by errors (errors,) or (errors, rows)."""
    out = dict(x)
    for s in kalman.estimated:
        at = kalman.errors.index(kalman.groups[s.name][0])
        if isinstance(s, Attitude):
            half = [np.ones_like(change[0]), *(0.5 * change[at : at + 3])]
            q = _times(half, [x[c] for c in s.components])
            out |= zip(s.components, q / np.sqrt((q * q).sum(axis=0)), strict=True)
        else:
            value = x[s.name] + change[at]
            out[s.name] = ops.wrap_ht(value) if s.unit == "ht" else value
    return out


def _times(p: Any, q: Any) -> FloatArray:
    return np.array(quaternion.product(p, q))
