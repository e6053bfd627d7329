"""The 13 error states: propagation once a second or at an index, one scalar update in a sample.

x = (dv 3, dku, phi 3, eps 3, nabla 3): errors of the strapdown, phi with C_true = (1 + phi x) C,
instruments' errors in the body. Over T seconds, in which C is taken half way::

    dv  += T (g (-phi_n, phi_e, 0) + C nabla)
    phi += -T w_ie x phi - T C eps - (0, 0, angle turned about up) dku

What the transport rate and the Coriolis force do to errors of some mm/s is below the noise words.
"""

from __future__ import annotations

import math
from typing import Any

from boresight import ops
from boresight.model.algebra.covariance import Symmetric, sheared
from boresight.model.algebra.quaternion import Vector, dot, scaled_matrix
from boresight.model.algebra.scalar_update import Measured, Update
from boresight.model.algebra.strapdown import Angles, Sample
from boresight.systems.array.interface import KINDS, UNITS

SCALE = 3
PHI, GYRO, FORCE = (4, 5, 6), (7, 8, 9), (10, 11, 12)
#: Growth of a diagonal element in every propagation, so that rounding stays below the noise.
FLOOR_NOISE = 2.0**-27
#: Variance, scaled, from which on a state that others move, and its noise, wait for a measurement.
LIMITS = {"velocity": 0.2, "tilt": 0.5, "heading": 0.5}
#: Sum of the instruments' variances, scaled, above which they grow no more.
FULL = 0.75
G = 9.8  #: m/s^2, of the model of the errors.


def propagated(
    p: Symmetric, start: Vector, end: Vector, seconds: Any, earth: tuple[Any, Any]
) -> Symmetric:
    """P after ``seconds``, in which the attitude went from ``start`` to ``end``.

    ``earth``: turn north, up in that time [rad]. ``seconds`` of zero change nothing. C half way is
    that of the mean quaternion: shorter by its length, as the mean of C over an arc is. A state
    whose variance is at its limit does not move.
    """
    half = [
        ops.bounded(0.5 * a + 0.5 * b, -1.0, 1.0, "mean") for a, b in zip(start, end, strict=True)
    ]
    c = [[ops.saturated(e, 1.0) for e in row] for row in scaled_matrix(half)]
    # z of end start^-1, twice: the angle turned about up
    w, x, y, z = start
    sine = end[3] * w - end[0] * z + end[2] * x - end[1] * y
    turned = ops.saturated(2.0 * sine, 2.0)

    def scaled(name: str, source: str, value: Any) -> Any:
        return (UNITS[source] / UNITS[name]) * value

    north, up = (ops.bounded(r, -1e-4, 1e-4, "earth") for r in earth)
    e, n, u = PHI
    active = {k: p[k][k] < LIMITS[KINDS[k]] for k in (0, 1, 2, *PHI)}
    time = {k: ops.where(f, seconds, 0.0) for k, f in active.items()}
    pull = {k: scaled("velocity", "tilt", G) * time[k] for k in (0, 1)}
    push = [scaled("velocity", "force", 1.0) * time[k] for k in range(3)]
    force = [
        {k: r * m for k, m in zip(FORCE, row, strict=True)} for r, row in zip(push, c, strict=True)
    ]
    p = sheared(p, {0: {n: -pull[0], **force[0]}, 1: {e: pull[1], **force[1]}, 2: force[2]})
    drift = [scaled(KINDS[k], "gyro", -1.0) * time[k] for k in PHI]
    gyro = [
        {k: r * m for k, m in zip(GYRO, row, strict=True)} for r, row in zip(drift, c, strict=True)
    ]
    row_e = [ops.where(active[e], w, 0.0) for w in (up, scaled("tilt", "heading", north))]
    p = sheared(p, {e: {n: row_e[0], u: -row_e[1], **gyro[0]}})
    entry_n = ops.where(active[n], up, 0.0)
    entry_u = ops.where(active[u], scaled("heading", "tilt", north), 0.0)
    moving = ops.where(active[u] & (seconds > 0.0), turned, 0.0)
    rows = {
        n: {e: -entry_n, **gyro[1]},
        u: {e: entry_u, SCALE: -scaled("heading", "scale", moving), **gyro[2]},
    }
    return sheared(p, rows)


def moves(update: Update) -> list[Any]:
    """Corrections of the 13 states, in their units."""
    step = {k: unit * update.move for k, unit in UNITS.items()}
    return [step[k] * g for k, g in zip(KINDS, update.gain, strict=True)]


def first_variances(p: Any) -> dict[str, Any]:
    """P0 by kind, scaled."""
    roots = {k: (1.0 / unit) * getattr(p, f"p0_{k}") for k, unit in UNITS.items()}
    return {k: root * root for k, root in roots.items()}


def grown(x: Any, p: Any, seconds: Any, due: Any, erecting: Any) -> list[Any]:
    """Growth of the 13 variances in a propagation, scaled.

    Variances of the instruments, which may be unobservable, stop while their sum is near one, the
    others each at its own limit. During the erection those of the accelerometers restart each time.
    """
    slow = dot([1.0] * 7, [getattr(x, f"p{k}{k}") for k in "3789abc"])
    floor = ops.where(due, FLOOR_NOISE, 0.0)
    slow_floor = ops.where(slow < FULL, floor, 0.0)
    slow_time = ops.where(slow < FULL, seconds, 0.0)

    def walk(name: str, kind: str, time: Any) -> Any:
        root = (1.0 / UNITS[kind]) * getattr(p, name)
        return (root * root) * time

    erected = (1.0 / UNITS["force"]) * p.erected_force
    force = walk("force_walk", "force", slow_time) + slow_floor
    growth = {
        "velocity": walk("force_noise", "velocity", seconds) + floor,
        "scale": slow_floor,
        "tilt": walk("gyro_noise", "tilt", seconds) + floor,
        "heading": walk("gyro_noise", "heading", seconds) + floor,
        "gyro": walk("gyro_walk", "gyro", slow_time) + slow_floor,
        "force": ops.where(erecting & due, erected * erected, force),
    }
    return [
        ops.where(getattr(x, f"p{i}{i}") < LIMITS[k], growth[k], 0.0) if k in LIMITS else growth[k]
        for i, k in enumerate(KINDS)
    ]


# -- measurement by an index of the azimuth, in both readings -------------------------------------


def heading_row(seen: Angles) -> dict[int, Any]:
    """d(heading)/d(phi) times cos(pitch): (C_12 sin, C_22 sin, -cos^2)/cos, of unit length."""
    share = UNITS["tilt"] / UNITS["heading"]
    level = [ops.saturated(y * seen.secant, 1.0) for y in seen.y[:2]]
    tilt = [share * (y * seen.y[2]) for y in level]
    return dict(zip(PHI, [*tilt, -seen.cosine], strict=True))


def offset(u: Any, sample: Sample, seen: Angles) -> Any:
    """Heading at the index less the azimuth there [half turns].

    heading' = (w_z C_33 + w_x C_31)/cos^2(pitch)
    """
    along = (sample.turn[2] * seen.up[1] + sample.turn[0] * seen.up[0]) * seen.secant
    along = ops.saturated(ops.saturated(along, 2.0**-5) * seen.secant, 2.0**-4)
    passed = (1.0 / math.pi) * (along - along * u.index_time)
    return ops.wrap_ht(seen.outputs["heading"] - passed - u.azimuth)


def fix(p: Any, seen: Angles, off: Any) -> Measured:
    """The heading: z cos(pitch) = row . phi."""
    root = (1.0 / UNITS["heading"]) * p.index_sd * seen.cosine
    z = ops.saturated((math.pi / UNITS["heading"]) * off, 8.0) * seen.cosine
    return Measured(heading_row(seen), z, root * root)


def change(x: Any, p: Any, off: Any, turned: Any) -> Measured:
    """The scale factor, (change - 360 deg)/360 deg over one turn; after more or less, nothing."""
    full_turn = (turned < 3.0) & (turned > -3.0)
    difference = ops.flip(turned < 0.0, ops.wrap_ht(off - x.last_off))
    z = ops.saturated((0.5 / UNITS["scale"]) * ops.where(full_turn, difference, 0.0), 8.0)
    root = ops.saturated((math.sqrt(0.5) / math.pi / UNITS["scale"]) * p.index_sd, 1.0)
    return Measured({SCALE: ops.where(full_turn, 1.0, 0.0)}, z, root * root)


def corrected(off: Any, seen: Angles, update: Update) -> Any:
    """The offset after a correction, which is no change that the gyro saw: less row . phi/cos."""
    row = heading_row(seen)
    along = ops.saturated(dot(list(row.values()), [update.gain[k] for k in row]), 1.0)
    angle = ops.saturated(along * (UNITS["heading"] * update.move), 0.25)
    angle = ops.saturated(angle * seen.secant, 0.5)
    return ops.wrap_ht(off - (1.0 / math.pi) * angle)
