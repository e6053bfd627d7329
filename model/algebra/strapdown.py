"""Strapdown in east, north, up: attitude in two words, velocity, without trigonometry.

For any estimator whose states and inputs hold those of `states` and `INPUTS`, increments of
integrating instruments. Titterton & Weston, Strapdown Inertial Navigation Technology, 2004, ch. 11;
Savage, J. Guidance 21(1, 2), 1998: with the increments of the sample
before, a_1 and d_1 for the angle and the velocity,

    turn   = a + a_1 x a / 12                                       (coning)
    force  = d + a x (d/2 + a x d / 6) + (a_1 x d + d_1 x a) / 12    (rotation and sculling)

The stored attitude already includes the slow turns of the next sample (Earth, transport rate, gyro
biases, corrections): a turn of the body is a product from the right, one of the axes from the left,
and they commute. So the attitude at a sample is q dq.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import reduce
from itertools import permutations, product
from typing import Any

from boresight.model import ops
from boresight.model.algebra import quaternion
from boresight.model.algebra.angles import steep_angle_ht, unit_angle_ht
from boresight.model.algebra.carried import BELOW, carried
from boresight.model.algebra.ellipsoid import Site
from boresight.model.algebra.quaternion import Vector, cross, dot, vector_times
from boresight.model.declarations import Input, Output, Param, State

AXES, NAVIGATION = "xyz", "enu"
STEP_TURN = 2.0**-7  #: rad, full scale of an increment.
MATRIX = 2.0**-9  #: largest element of the calibration matrices beside the diagonal.
STEP_FORCE = 2.0**-2  #: m/s, the same.
VELOCITY = 4.0  #: m/s, largest velocity.
FULL_SCALE = 1.0 - 2.0**-16  #: share of it from which on an increment counts as beyond.
SLOW = 2.0**-17  #: rad, most that the axes turn in half a sample.
FAST = 2.0**-7  #: rad, half the largest correction: more than half the Earth's turn in 150 s.


INPUTS = (
    *(
        Input(f"{name}_{a}", -high, high * BELOW, unit, clamp=True, meaning=f"{text}, axis {a}")
        for name, high, unit, text in (
            ("dtheta", STEP_TURN, "rad", "turn in the sample"),
            ("dv", STEP_FORCE, "m/s", "integral of the specific force over the sample"),
        )
        for a in AXES
    ),
)
OUTPUTS = (
    *(Output(name, "ht", 0.3 / 648000.0) for name in ("pitch", "roll", "heading")),
    *(Output(f"q{a}", "", 1e-6) for a in "wxyz"),
    *(Output(f"v{a}", "m/s", 2e-5) for a in NAVIGATION),
)


def states(start: Vector) -> tuple[State, ...]:
    """Attitude in two words, velocity, what `sampled` keeps of the last increments."""
    return (
        *(State(f"q{a}", -1.0, BELOW, "", c) for a, c in zip("wxyz", start, strict=True)),
        *(State(f"rest_{a}", -(2.0**-15), 2.0**-15 * BELOW) for a in "wxyz"),
        *(State(f"v{a}", -VELOCITY, VELOCITY * BELOW, "m/s") for a in NAVIGATION),
        *(
            State(f"coning_{r}{c}", -2.0 * MATRIX, 2.0 * MATRIX * BELOW)
            for r, c in permutations(AXES, 2)
        ),
        *(State(f"last_force_{a}", -STEP_FORCE, STEP_FORCE * BELOW) for a in AXES),
    )


def params(latitude: float, height: float, start: list[float]) -> tuple[Param, ...]:
    """Calibration of the instruments, site [half turns, m], attitude after a restart.

    Increments become matrix (increments) - bias dt. The square of the angle is of the gyro as it
    came: at full scale the turn is off by 1e-5 of (matrix - 1).
    """
    edge = 89.0 / 180.0
    kinds = ("gyro", 2.0**-14, "rad/s"), ("force", 2.0**-3, "m/s^2")
    return (
        *(
            Param(f"{name}_{r}{c}", 1.0, 1.0 - MATRIX, 1.0 + MATRIX, "", f"scale, {name} {r}")
            if r == c
            else Param(f"{name}_{r}{c}", 0.0, -MATRIX, MATRIX, "", f"{name} {r} from sensor {c}")
            for (name, _, _), r, c in product(kinds, AXES, AXES)
        ),
        *(
            Param(f"{name}_bias_{a}", 0.0, -high, high, unit, "subtracted after the matrix")
            for (name, high, unit), a in product(kinds, AXES)
        ),
        Param("latitude", latitude, -edge, edge, "ht", "of the site, north"),
        Param("height", height, -500.0, 10e3, "m", "of the site, above the ellipsoid"),
        *(
            Param(f"start_q{a}", c, -1.0, BELOW, "", "attitude after a restart")
            for a, c in zip("wxyz", start, strict=True)
        ),
    )


def ahead(start: Vector, site: Site) -> list[Any]:
    """Initial attitude, with the Earth's turn of one sample as in `next_attitude`."""
    moved = vector_times((0.0, *(-0.5 * w for w in site.earth)), start)
    return [min(c + m, BELOW) for c, m in zip(start, moved, strict=True)]


@dataclass(frozen=True)
class Sample:
    """Attitude at a sample, and its increments in body axes."""

    q: list[Any]
    step: list[Any]
    turn: list[Any]
    force: list[Any]
    last: dict[str, Any]


def sampled(x: Any, u: Any, p: Any) -> Sample:
    """Attitude after the increments of ``u``, times the matrices of ``p``; biases remain.

    The state ``coning`` is the gyros' matrix beside its diagonal, and a_1 x of the sample before,
    so that both take one product.
    """
    a = [getattr(u, f"dtheta_{k}") for k in AXES]
    d = [getattr(u, f"dv_{k}") for k in AXES]
    d = [dot([getattr(p, f"force_{r}{k}") for k in AXES], d) for r in AXES]
    d = [ops.saturated(c, STEP_FORCE) for c in d]
    a1 = [getattr(x, f"coning_{r}") - getattr(p, f"gyro_{r}") for r in ("zy", "xz", "yx")]
    d1 = [getattr(x, f"last_force_{k}") for k in AXES]
    rows = [
        [getattr(p if r == k else x, f"{'gyro' if r == k else 'coning'}_{r}{k}") for k in AXES]
        for r in AXES
    ]
    turned = [ops.saturated(dot(row, a), STEP_TURN) for row in rows]
    q = [getattr(x, f"q{k}") for k in "wxyz"]
    # coning changes the square of the angle by 1e-9 of the angle at most
    after, step = quaternion.small_turn(q, turned, STEP_TURN, nearly=a)
    bent = [0.5 * c + (1.0 / 6.0) * e for c, e in zip(d, cross(turned, d), strict=True)]
    force = [
        ops.saturated(c + e + f + g, 2.0 * STEP_FORCE)
        for c, e, f, g in zip(d, cross(turned, bent), cross(a1, d), cross(d1, a), strict=True)
    ]
    x12, y12, z12 = ((1.0 / 12.0) * c for c in a)
    coning = {"xy": -z12, "xz": y12, "yx": z12, "yz": -x12, "zx": -y12, "zy": x12}
    last = {f"coning_{k}": getattr(p, f"gyro_{k}") + c for k, c in coning.items()}
    last |= {f"last_force_{k}": (1.0 / 12.0) * c for k, c in zip(AXES, d, strict=True)}
    return Sample(after, step, turned, force, last)


@dataclass(frozen=True)
class Angles:
    """Angles of C = Rz(heading) Rx(pitch) Ry(roll), [half turns], in ``outputs`` by name.

    ``y``: the body's y axis east, north, up; ``up``: x and z of up in the body; ``cosine``,
    ``secant``: of the pitch.
    """

    outputs: dict[str, Any]
    y: tuple[Any, Any, Any]
    up: tuple[Any, Any]
    cosine: Any
    secant: Any


def angles(q: Vector) -> Angles:
    """Angles of a unit quaternion; at a pitch of 90 deg heading and roll are undefined."""
    w, x, y, z = q
    west, x_down = 2.0 * w * z - 2.0 * x * y, 2.0 * w * y - 2.0 * x * z
    c22, c32 = 1.0 - 2.0 * x * x - 2.0 * z * z, 2.0 * y * z + 2.0 * w * x
    elements = (west, x_down, c22, c32, 1.0 - 2.0 * x * x - 2.0 * y * y)
    west, x_down, c22, c32, c33 = (ops.saturated(c, 1.0) for c in elements)
    square = x_down * x_down + c33 * c33
    secant = ops.rsqrt(square)
    cosine = ops.saturated(square * secant, 1.0)
    outputs = {
        "pitch": steep_angle_ht(c32, cosine, square < 0.5),
        "roll": unit_angle_ht(x_down, c33, secant),
        "heading": unit_angle_ht(west, c22, secant),
    }
    return Angles(outputs, (-west, c22, c32), (-x_down, c33), cosine, secant)


def velocity(
    x: Any, c: quaternion.Matrix, force: Vector, site: Site
) -> tuple[list[Any], list[Any]]:
    """Velocity after the sample, and turn of the axes meanwhile [rad].

    v += C force - (0, 0, g) dt - (2 w_ie + w_en) x v dt    w_en = (-vn/R_M, ve/R_N, ve tan(L)/R_N)
    """
    v = [getattr(x, f"v{k}") for k in NAVIGATION]
    north, up = site.earth
    along, across, around = site.curvature
    carry = [-(along * v[1]), across * v[0], around * v[0]]
    rate = [carry[0], 2.0 * north + carry[1], 2.0 * up + carry[2]]
    rate = [ops.bounded(w, -(2.0**-16), 2.0**-16, "rate of the axes") for w in rate]
    # C is that of the end of the sample, half a sample of the Earth's turn too late.
    early = 0.5 * site.gravity * north
    gained = quaternion.turn(c, force)
    parts = zip(v, gained, cross(rate, v), (-early, 0.0, site.gravity), strict=True)
    moved = [ops.saturated(s + f - w - o, VELOCITY) for s, f, w, o in parts]
    slow = [carry[0], north + carry[1], up + carry[2]]
    return moved, slow


def next_attitude(
    x: Any, sample: Sample, base: Vector, slow: Vector, correction: Vector, begin: Any
) -> dict[str, Any]:
    """Next states of the attitude, of norm one: ``base`` turned by ``slow`` and ``correction``.

    Both turns are in [rad] about the axes; a correction is clamped at twice `FAST`. ``base`` is
    the sample's attitude, or where ``begin`` holds the initial one.
    """
    # (0, angle)/2 x q: separate words for small, constant turns. Norm: q (1 - |q|^2)/2
    slow_turn = vector_times([ops.saturated(0.5 * w, SLOW) for w in slow], base)
    fast_turn = vector_times([ops.saturated(0.5 * w, FAST) for w in correction], base)
    norm_error = ops.saturated(0.5 - 0.5 * dot(base, base), 2.0**-10)
    after: dict[str, Any] = {}
    for k, a in enumerate("wxyz"):
        slowly = ops.saturated(slow_turn[k], 2.0 * SLOW)
        fast = ops.saturated(fast_turn[k] + norm_error * base[k], 2.0 * FAST)
        high, low, moves = getattr(x, f"q{a}"), getattr(x, f"rest_{a}"), [sample.step[k]]
        total, rest = carried(high, low, moves, 1.0, begin, base[k], [slowly, fast])
        after |= {f"q{a}": total, f"rest_{a}": rest}
    return after


def beyond(u: Any) -> Any:
    """Whether an increment is at full scale."""
    limits = (("dtheta", STEP_TURN * FULL_SCALE), ("dv", STEP_FORCE * FULL_SCALE))
    increments = [(getattr(u, f"{name}_{a}"), limit) for name, limit in limits for a in AXES]
    return reduce(operator.or_, (ops.absolute(x) > limit for x, limit in increments))
