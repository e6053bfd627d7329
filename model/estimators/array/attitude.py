"""Attitude of a radar array that turns for eight hours: strapdown and 13 error states.

Wang Wenzhe et al., Modern Radar 38(9), 2016, with what its equations lost put back
(`docs/array.md`): axes east, north, up; body x right, y the array's normal, z up,
C = Rz(heading) Rx(pitch) Ry(roll), heading counter-clockwise.

* Every sample: `strapdown`, less gyro biases eps, and along up the scale factor dku.
* Every second, or at an index: P is propagated (`error_filter`); in the three samples after it each
  velocity is measured as zero, closed loop. So each sample has at most one scalar update.
* At an index of the azimuth, at its time within the sample, z = heading - azimuth; with
  ``reading`` "literal", H = [I4 0], z is the change of that from one turn to the next over 360 deg,
  which measures dku and leaves the heading as it is.
* A heading that nothing measures is cut along its variance, without innovation, before that leaves
  its word.
* While the array is erected its accelerometers' scale errors turn to other axes: P of their biases
  is set back, without correlations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from boresight.model import ops
from boresight.model.algebra.covariance import covariance_of, element_names
from boresight.model.algebra.quaternion import Vector, dot, matrix, multiply, turn
from boresight.model.errors import InputError, require
from boresight.model.estimator import Estimator
from boresight.model.estimators.array import error_filter as errors
from boresight.model.estimators.array import interface
from boresight.model.estimators.array import strapdown as sd
from boresight.model.estimators.array.interface import AXES, KINDS, NAVIGATION, STEP_TURN, UNITS
from boresight.model.estimators.ekf_parts import status_word

__all__ = ["ArrayAttitude"]

READINGS = ("heading", "literal")
CUT_AT = 0.7  #: variance of the heading from which on it is cut, scaled,
CUT_NOISE = 0.5  #: and with which noise.
REFUSED = 2.0**-6  #: what the heading's variance grows by where an index is beyond the gate.
FULL_SCALE = 1.0 - 2.0**-16  #: increments from there on count as beyond.


class ArrayAttitude(Estimator):
    """Attitude of an array that turns, from gyro and accelerometer increments and an index.

    Parameters
    ----------
    latitude : float
        Of the site [deg], up to 89.
    height : float
        Of the site, above the ellipsoid [m].
    attitude : (pitch, roll, heading)
        Before the first sample [deg].
    reading : str
        "heading" or "literal": what an index measures.
    rate : float
        Records a second.
    aided : bool
        False: strapdown alone.

    Raises
    ------
    InputError
        One of these is none of that.
    """

    name = "array_attitude"
    summary = "array that turns for hours: strapdown, 13-state filter, zero velocity, azimuth index"
    inputs = interface.INPUTS
    urgent = 3

    def __init__(
        self,
        latitude: float = 31.9521,
        height: float = 45.0,
        attitude: Sequence[float] = (1.0, 2.0, 90.0),
        reading: str = "heading",
        rate: float = 100.0,
        *,
        aided: bool = True,
    ) -> None:
        _check("latitude", latitude, -89.0, 89.0)
        _check("height", height, -500.0, 10e3)
        _check("rate", rate, 10.0, 1000.0)
        for name, value in zip(("pitch", "roll", "heading"), attitude, strict=True):
            _check(name, value, -360.0, 360.0)
        if reading not in READINGS:
            raise InputError.at(
                "array_attitude, reading",
                wanted=f"one of {', '.join(READINGS)}",
                found=repr(reading),
                fix="choose one of these",
            )
        self.dt, self.literal, self.aided = 1.0 / rate, reading == "literal", aided
        start = quaternion(*attitude)
        self.params = interface.strapdown_params(latitude / 180.0, height, start)
        place = sd.site(latitude / 180.0, height, self.dt)
        ahead = multiply((0.0, 0.0, *(-0.5 * w for w in place.earth)), start)
        ready = [min(c + w, interface.BELOW) for c, w in zip(start, ahead, strict=True)]
        self.states = interface.strapdown_states(ready)
        self.outputs = interface.OUTPUTS
        if aided:
            self.params += interface.filter_params()
            first = errors.first_variances(
                SimpleNamespace(**{p.name: p.default for p in self.params})
            )
            self.states += interface.filter_states(start, [first[k] for k in KINDS], self.literal)
            self.outputs += interface.FILTER_OUTPUTS

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample: see the module docstring."""
        restart = u.phase < -0.5
        sample = sd.sampled(x, u)
        seen = sd.angles(sample.q)
        place = sd.site(p.latitude, p.height, self.dt)
        c = matrix([getattr(x, f"q{k}") for k in "wxyz"])
        start = [getattr(p, f"start_q{k}") for k in "wxyz"]
        base = [ops.where(restart, s, q) for s, q in zip(start, sample.q, strict=True)]
        force, filtered = sample.force, None
        if self.aided:
            nabla = [self.dt * getattr(x, f"nabla_{a}") for a in AXES]
            force = [f - n for f, n in zip(force, nabla, strict=True)]
        v, axes = sd.velocity(x, c, force, place)
        correction: Vector = (0.0, 0.0, 0.0)
        if self.aided:
            up = ops.bounded(dot(c[2], sample.turn), -2.0 * STEP_TURN, 2.0 * STEP_TURN, "up")
            eps = turn(c, [self.dt * getattr(x, f"eps_{a}") for a in AXES])
            axes = [axes[0] + eps[0], axes[1] + eps[1], axes[2] + eps[2] + x.scale_up * up]
            filtered = self._filtered(x, u, p, _Now(restart, sample, seen, place, v, up))
            v = [a - m for a, m in zip(v, filtered.moves[:3], strict=True)]
            correction = [filtered.moves[k] for k in errors.PHI]
        v = [ops.saturated(ops.where(restart, 0.0, a), interface.VELOCITY) for a in v]
        velocities = {f"v{a}": s for a, s in zip(NAVIGATION, v, strict=True)}
        after = velocities | sample.last
        after |= sd.kept(x, sample, base, [-a for a in axes], correction, restart)
        told = seen.told | {f"q{a}": q for a, q in zip("wxyz", sample.q, strict=True)} | velocities
        if filtered is None:
            return after, told
        for a in "wxyz":
            old = getattr(x, f"from_q{a}")
            after[f"from_q{a}"] = ops.where(filtered.due | restart, after[f"q{a}"], old)
        return after | filtered.states, told | filtered.told

    def _filtered(self, x: Any, u: Any, p: Any, now: _Now) -> _Filtered:
        """The filter's part of a sample."""
        restart, working = now.restart, u.phase > 1.5
        arrived = u.index > 0.5
        turned = ops.saturated(x.turned + (1.0 / math.pi) * now.up, 4.0)
        turned = ops.bounded(turned, -4.0, 4.0 * interface.BELOW, "saturated")
        apart = ops.absolute(turned)
        index = working & arrived & (x.count > 3.5) & (apart >= p.index_turn)
        count = ops.where(restart, 0.0, x.count + 1.0)
        due = (count > 1.0 / self.dt - 0.5) | index
        samples = ops.where(due, count, 0.0)
        earth = (samples * now.place.earth[0], samples * now.place.earth[1])
        ends = ([getattr(x, f"from_q{k}") for k in "wxyz"], now.sample.q)
        ahead = errors.propagated(covariance_of(x, 13), *ends, self.dt * samples, earth)

        # What is measured: a velocity, the index, or nothing where the heading is cut.
        before = [ops.where(count < k + 0.5, 1.0, 0.0) for k in range(4)]
        row = {k: b - a for k, (a, b) in enumerate(zip(before, before[1:], strict=False))}
        wide = x.p66 > CUT_AT
        cut = wide & (count > 3.5) & ~index
        off = self._off(u, now)
        measured, told, noise = self._index(x, p, now, off, turned, index)
        along = {k: ops.where(cut, h, 0.0) for k, h in heading_row(now.seen).items()}
        for k, h in measured.items():
            along[k] = ops.where(index, h, along[k]) if k in along else ops.where(index, h, 0.0)
        zero = dot(list(row.values()), [(1.0 / UNITS["velocity"]) * a for a in now.v])
        zupt = (1.0 / UNITS["velocity"]) * p.zupt_sd
        update = errors.updated(
            ahead,
            row | along,
            ops.where(index, noise, ops.where(cut, CUT_NOISE, zupt * zupt)),
            ops.saturated(zero, 8.0) + ops.where(index, told, 0.0),
            ops.where(index & ~wide, p.index_gate, 2.0 * errors.MOVE_LIMIT),
        )

        # What P loses and grows by.
        erecting = (u.phase > 0.5) & ~working
        anew = errors.first_variances(p)
        more = errors.noises(x, p, self.dt * samples, due)
        more["heading"] = ops.where(update.beyond, REFUSED, more["heading"])
        more = {k: ops.where(restart, anew[k], g) for k, g in more.items()}
        erected = (1.0 / UNITS["force"]) * p.erected_force
        erected = ops.where(erecting & due, erected * erected, more["force"])
        more["force"] = ops.where(restart, anew["force"], erected)
        keep = (~restart, ~(restart | (erecting & due)))
        p_after = errors.lowered(ahead, update, *keep, [more[k] for k in KINDS])

        step = {k: unit * update.move for k, unit in UNITS.items()}
        moves = [step[k] * g for k, g in zip(KINDS, update.gain, strict=True)]
        learnt = ((errors.GYRO, "eps"), (errors.FORCE, "nabla"))
        names = {k: f"{n}_{a}" for group, n in learnt for k, a in zip(group, AXES, strict=True)}
        names[errors.SCALE] = "scale_up"
        limits = {s.name: s.high / interface.BELOW for s in self.states}
        instruments = {
            name: ops.saturated(ops.where(restart, 0.0, getattr(x, name) + moves[k]), limits[name])
            for k, name in names.items()
        }
        used = index & ~update.beyond
        flags = {
            0: u.phase < 0.5,
            1: erecting,
            2: arrived & ~working,
            3: (arrived & working & ~index) | update.beyond,
            4: _beyond(u),
            5: wide,
            6: used,
            7: apart >= 3.0,
        }
        states = {
            **instruments,
            **{name: p_after[i][j] for name, i, j in element_names(13)},
            "count": ops.where(due, 0.0, count),
            "turned": ops.where(restart, 4.0 * interface.BELOW, ops.where(used, 0.0, turned)),
        }
        if self.literal:
            # Corrections are no change that the gyro has seen: heading -= row . phi / cos
            h = heading_row(now.seen)
            fixed = ops.saturated(dot(list(h.values()), [update.gain[k] for k in h]), 1.0)
            fixed = ops.saturated(
                ops.saturated(fixed * step["heading"], 0.25) * now.seen.secant, 0.5
            )
            old = ops.where(used, off, x.last_off)
            states["last_off"] = ops.wrap_ht(old - (1.0 / math.pi) * fixed)
        return _Filtered(states, instruments | {"status": status_word(flags)}, moves, due)

    @staticmethod
    def _off(u: Any, now: _Now) -> Any:
        """Heading at the index less the azimuth there [half turns].

        heading' = (w_z C_33 + w_x C_31)/cos^2(pitch)
        """
        up, secant = now.seen.up, now.seen.secant
        along = (now.sample.turn[2] * up[1] + now.sample.turn[0] * up[0]) * secant
        along = ops.saturated(ops.saturated(along, 2.0**-5) * secant, 2.0**-4)
        passed = (1.0 / math.pi) * (along - along * u.index_time)
        return ops.wrap_ht(now.seen.told["heading"] - passed - u.azimuth)

    def _index(
        self, x: Any, p: Any, now: _Now, off: Any, turned: Any, index: Any
    ) -> tuple[dict[int, Any], Any, Any]:
        """Row, innovation and variance of an index, scaled."""
        if not self.literal:
            # heading - azimuth = row . phi, all times the cosine of the pitch
            cosine = now.seen.cosine
            sd_scaled = (1.0 / UNITS["heading"]) * p.index_sd * cosine
            z = ops.saturated((math.pi / UNITS["heading"]) * off, 8.0) * cosine
            return heading_row(now.seen), z, sd_scaled * sd_scaled
        # The change over a turn, where there was one, over 360 deg.
        whole = (turned < 3.0) & (turned > -3.0)
        change = ops.flip(turned < 0.0, ops.wrap_ht(off - x.last_off))
        z = ops.saturated((0.5 / UNITS["scale"]) * change, 8.0)
        sd_scaled = (math.sqrt(0.5) / math.pi / UNITS["scale"]) * p.index_sd
        sd_scaled = ops.saturated(sd_scaled, 1.0)  # 43 arcsec
        return {errors.SCALE: ops.where(whole, 1.0, 0.0)}, z, sd_scaled * sd_scaled


@dataclass(frozen=True)
class _Now:
    """What a sample's strapdown gave; ``up``: the turn about up [rad]."""

    restart: Any
    sample: sd.Sample
    seen: sd.Angles
    place: sd.Site
    v: list[Any]
    up: Any


@dataclass(frozen=True)
class _Filtered:
    """States and outputs of the filter; what the 13 states move by; whether P was propagated."""

    states: dict[str, Any]
    told: dict[str, Any]
    moves: list[Any]
    due: Any


def heading_row(seen: sd.Angles) -> dict[int, Any]:
    """d(heading)/d(phi) times the cosine of the pitch, scaled."""
    share = UNITS["tilt"] / UNITS["heading"]
    tilt = [
        ops.bounded(
            share * (ops.bounded(y * seen.secant, -1.0, 1.0, "unit") * seen.y[2]),
            -share,
            share,
            "row",
        )
        for y in seen.y[:2]
    ]
    return dict(zip(errors.PHI, [*tilt, -seen.cosine], strict=True))


def quaternion(pitch: float, roll: float, heading: float) -> list[float]:
    """Of angles [deg]."""
    (sp, cp), (sr, cr), (sh, ch) = (ops.sincos_ht(a / 360.0) for a in (pitch, roll, heading))
    q = multiply(multiply([ch, 0.0, 0.0, sh], [cp, sp, 0.0, 0.0]), [cr, 0.0, sr, 0.0])
    return [min(c, interface.BELOW) for c in q]


def _beyond(u: Any) -> Any:
    """Whether an increment is at full scale."""
    found = None
    for name, full in (("dtheta", STEP_TURN), ("dv", interface.STEP_FORCE)):
        for a in AXES:
            one = ops.absolute(getattr(u, f"{name}_{a}")) > full * FULL_SCALE
            found = one if found is None else found | one
    return found


def _check(name: str, value: float, low: float, high: float) -> None:
    require(low <= value <= high, f"array_attitude, {name}", f"{low:g} to {high:g}", value)
