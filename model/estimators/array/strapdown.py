"""Strapdown in east, north, up at 100 Hz: attitude in two words, velocity, no trigonometry of it.

Increments are those of integrating instruments. Titterton & Weston, Strapdown Inertial Navigation
Technology, 2004, ch. 11; Savage, J. Guidance 21(1, 2), 1998: with the increments of the sample
before, a_1 and d_1 for the angle and the velocity,

    turn   = a + a_1 x a / 12                                       (coning)
    force  = d + a x d / 2 + (a_1 x d + d_1 x a) / 12                (rotation and sculling)

The attitude is kept turned on by what turns slowly, as it will be after the next sample (Earth,
transport rate, gyro biases, corrections): a turn of the body is a product from the right, one of
the axes from the left, and they commute. So a sample's own attitude is q dq.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import steep_angle_ht, unit_angle_ht
from boresight.model.algebra.carried import carried
from boresight.model.algebra.quaternion import (
    Matrix,
    Vector,
    cross,
    dot,
    small_turn,
    turn,
    vector_times,
)
from boresight.model.estimators.array.interface import (
    AXES,
    NAVIGATION,
    STEP_FORCE,
    STEP_TURN,
    VELOCITY,
)

__all__ = ["Angles", "Sample", "Site", "angles", "kept", "sampled", "site", "velocity"]

EARTH = 7.292115e-5  #: rad/s, WGS 84.
EQUATOR = 6378137.0  #: m
E2 = 6.69437999014e-3  #: eccentricity squared.
GAMMA = (9.7803253359, 1.931852652458e-3)  #: m/s^2, of Somigliana's formula.
FREE_AIR = (2.0 * 1.006802597, 2.0 * 6.70562e-3)  #: (1 + f + m, f) twice, over the height/equator.
SLOW = 2.0**-17  #: rad, most that the axes turn in half a sample.
FAST = 2.0**-8  #: rad, half the largest correction by a filter.


@dataclass(frozen=True)
class Site:
    """What the place decides, per sample.

    ``earth``: north and up, rad; ``gravity``: m/s; ``curvature``: of meridian, prime vertical,
    and the second times the tangent of the latitude, rad/s per m/s.
    """

    earth: tuple[Any, Any]
    gravity: Any
    curvature: tuple[Any, Any, Any]


def site(latitude: Any, height: Any, dt: float) -> Site:
    """Earth rate, gravity and curvatures on the ellipsoid of WGS 84.

    Somigliana's gravity with the free-air gradient to second order, and radii to first order of
    the height, in series of e^2 sin^2: 1e-8 m/s^2 and 1e-8 of the radii.
    """
    sine, cosine = ops.sincos_ht(latitude)
    cosine = ops.bounded(cosine, 0.0174, 1.0, "up to 89 deg")
    s2 = ops.bounded(sine * sine, 0.0, 1.0, "square")
    # 1/sqrt(1 - e^2 s^2), four terms
    x = E2 * s2
    root = 1.0 + x * (0.5 + x * (0.375 + x * 0.3125))
    up = (1.0 / EQUATOR) * height
    normal = GAMMA[0] * (1.0 + GAMMA[1] * s2) * root
    lift = 1.0 - up * (FREE_AIR[0] - FREE_AIR[1] * s2 - 3.0 * up)
    gravity = ops.bounded(dt * normal * lift, 9.7 * dt, 9.9 * dt, "gravity")
    # 1/R_N = sqrt(1 - e^2 s^2)/a, 1/R_M = (1 - e^2 s^2)^1.5/(a (1 - e^2))
    flat = 1.0 - x * (0.5 + x * (0.125 + x * 0.0625))
    across = (dt / EQUATOR) * flat * (1.0 - up * flat)
    bent = (1.0 - x) * flat * (1.0 / (1.0 - E2))
    along = (dt / EQUATOR) * bent * (1.0 - up * bent)
    return Site(
        (EARTH * dt * cosine, EARTH * dt * sine),
        gravity,
        (along, across, ops.bounded(across * (sine / cosine), -1e-3 * dt, 1e-3 * dt, "89 deg")),
    )


@dataclass(frozen=True)
class Sample:
    """A sample's own attitude, and what its increments are in the body's axes."""

    q: list[Any]
    step: list[Any]
    turn: list[Any]
    force: list[Any]
    last: dict[str, Any]


def sampled(x: Any, u: Any) -> Sample:
    """Attitude after the increments of ``u``."""
    a = [getattr(u, f"dtheta_{k}") for k in AXES]
    d = [getattr(u, f"dv_{k}") for k in AXES]
    a1 = [getattr(x, f"last_turn_{k}") for k in AXES]  # over 12, as d1
    d1 = [getattr(x, f"last_force_{k}") for k in AXES]
    turned = [ops.saturated(c + e, STEP_TURN) for c, e in zip(a, cross(a1, a), strict=True)]
    q = [getattr(x, f"q{k}") for k in "wxyz"]
    # coning changes the square of the angle by 1e-9 of the angle at most
    after, step = small_turn(q, turned, STEP_TURN, nearly=a)
    arm = [0.5 * c + e for c, e in zip(a, a1, strict=True)]
    force = [
        ops.saturated(c + e + f, 2.0 * STEP_FORCE)
        for c, e, f in zip(d, cross(arm, d), cross(d1, a), strict=True)
    ]
    last = {f"last_turn_{k}": (1.0 / 12.0) * c for k, c in zip(AXES, a, strict=True)}
    last |= {f"last_force_{k}": (1.0 / 12.0) * c for k, c in zip(AXES, d, strict=True)}
    return Sample(after, step, turned, force, last)


@dataclass(frozen=True)
class Angles:
    """Of C = Rz(heading) Rx(pitch) Ry(roll), [half turns].

    ``y``: the body's y axis east, north, up; ``up``: x and z of up in the body; ``cosine``,
    ``secant``: of the pitch.
    """

    told: dict[str, Any]
    y: tuple[Any, Any, Any]
    up: tuple[Any, Any]
    cosine: Any
    secant: Any


def angles(q: Vector) -> Angles:
    """Angles of a unit quaternion; at a pitch of 90 deg heading and roll are any."""
    w, x, y, z = q
    west, x_down, c22, c32, c33 = (
        ops.bounded(c, -1.0, 1.0, "rotation matrix")
        for c in (
            2.0 * w * z - 2.0 * x * y,
            2.0 * w * y - 2.0 * x * z,
            1.0 - 2.0 * x * x - 2.0 * z * z,
            2.0 * y * z + 2.0 * w * x,
            1.0 - 2.0 * x * x - 2.0 * y * y,
        )
    )
    square = x_down * x_down + c33 * c33
    secant = ops.rsqrt(square)
    cosine = ops.bounded(square * secant, 0.0, 1.0, "cosine of the pitch")
    told = {
        "pitch": steep_angle_ht(c32, cosine, square < 0.5),
        "roll": unit_angle_ht(x_down, c33, secant),
        "heading": unit_angle_ht(west, c22, secant),
    }
    return Angles(told, (-west, c22, c32), (-x_down, c33), cosine, secant)


def velocity(x: Any, c: Matrix, force: Vector, place: Site) -> tuple[list[Any], list[Any]]:
    """Velocity after the sample, and how far the axes turn meanwhile [rad].

    v += C force - (0, 0, g) dt - (2 w_ie + w_en) x v dt    w_en = (-vn/R_M, ve/R_N, ve tan(L)/R_N)
    """
    v = [getattr(x, f"v{k}") for k in NAVIGATION]
    north, up = place.earth
    along, across, around = place.curvature
    carry = [-(along * v[1]), across * v[0], around * v[0]]
    wide = [carry[0], 2.0 * north + carry[1], 2.0 * up + carry[2]]
    wide = [ops.bounded(w, -(2.0**-16), 2.0**-16, "rate of the axes") for w in wide]
    # C stands for the end of the sample in axes of the end: half a sample of Earth too far.
    early = 0.5 * place.gravity * north
    moved = [
        ops.saturated(s + f - w - o, VELOCITY)
        for s, f, w, o in zip(
            v, turn(c, force), cross(wide, v), (-early, 0.0, place.gravity), strict=True
        )
    ]
    slow = [carry[0], north + carry[1], up + carry[2]]
    return moved, slow


def kept(
    x: Any, sample: Sample, base: Vector, slow: Vector, correction: Vector, begin: Any
) -> dict[str, Any]:
    """States of the attitude: turned on by ``slow`` and ``correction`` [rad, axes], of norm one.

    ``base``: the sample's attitude, or where ``begin`` holds the one to begin with.
    """
    # (0, angle)/2 x q: words of its own for what is small and always there. q (1 - |q|^2)/2
    ahead = vector_times([ops.saturated(0.5 * w, SLOW) for w in slow], base)
    moved = vector_times([ops.saturated(0.5 * w, FAST) for w in correction], base)
    short = ops.saturated(0.5 - 0.5 * dot(base, base), 2.0**-10)
    after = {}
    for k, a in enumerate("wxyz"):
        moves = [
            ops.saturated(ahead[k], 2.0 * SLOW),
            ops.saturated(moved[k] + short * base[k], 2.0 * FAST),
        ]
        q, rest = getattr(x, f"q{a}"), getattr(x, f"rest_{a}")
        after[f"q{a}"], after[f"rest_{a}"] = carried(
            q, rest, [sample.step[k]], 1.0, begin, base[k], moves
        )
    return after
