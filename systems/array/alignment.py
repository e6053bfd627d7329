"""Initial alignment at rest: levelling and gyrocompassing, in inertial axes.

The strapdown's attitude, turned by the gyros alone, holds inertial axes s, however the array
shakes. In s the Earth turns the specific force f. With t from 0 to 1 over T seconds, and vectors
half way::

    up    ~  T integral t (1 - t) f
    east  ~  T integral t (1 - t) (2 t - 1) f  =  g (w_ie x up) T^2/60

(Gravity in inertial axes: Silson, IEEE Trans. Instrum. Meas. 60(6), 2011.) The weights vanish at
both ends, so a vibration hardly counts; the second has no mean, so a tilt of s does not. Samples
count up to zero, where the filter begins.

Errors, with w = w_ie cos(latitude): heading (gyro bias east)/w, of a gyro's angle walk sigma
[rad/sqrt(s)] 1.2 sigma/(w sqrt(T)), of an accelerometer's noise a [m/s^2/sqrt(Hz)]
4.1 a/(g w T^1.5); tilt (accelerometer bias)/g. The mean of a vector that turns by w_ie T is shorter
across the axis, so up is (w_ie T)^2/80 sin(2 latitude) too far north, which is known.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from boresight import State, ops
from boresight.model.algebra.carried import BELOW
from boresight.model.algebra.quaternion import Vector, dot, product
from boresight.model.algebra.strapdown import AXES, STEP_FORCE

STEEP = 0.0013  #: squared sine of a tilt of s, 2.1 deg, that overflows no sum; else s is levelled.


class Alignment(NamedTuple):
    """Result of a sample."""

    running: Any  #: the attitude is not known yet.
    found: Any  #: it is in this sample, or level axes.
    q: list[Any]  #: the attitude half way, turned by the gyros since.
    turned: list[Any]  #: the axes since then [rad].
    count: Any  #: the next.
    up: list[Any]  #: sums over their limit, kept in place of ``from_q``.
    states: dict[str, Any]


def _limit(samples: int, dt: float) -> float:
    """Power of two [m/s] above the sum of up, g T/6; that of east is a 128th of it at most."""
    return 2.0 ** math.ceil(math.log2(10.0 * samples * dt / 6.0))


def states(samples: int, dt: float) -> tuple[State, ...]:
    """Sums of east; those of up are in states that the filter needs later."""
    high = _limit(samples, dt) / 128.0
    return tuple(State(f"east_{a}", -high, high * BELOW, "m/s") for a in "xy")


def aligned(
    x: Any, phase: Any, q: Vector, force: Vector, earth: Vector, samples: int, dt: float
) -> Alignment:
    """One sample of the alignment; it begins again where the array moves.

    ``q``: attitude in s at the end of the sample; ``force``: its specific force in s [m/s];
    ``earth``: turn of the Earth in a sample, north and up [rad].
    """
    running, last, first = x.count < -0.5, x.count > -1.5, -1.0 - samples
    still = (phase > -0.5) & (phase < 0.5)
    sums = [getattr(x, f"from_q{a}") for a in AXES]
    length = ops.rsqrt(dot(sums, sums))
    up = [ops.saturated(s * length, 1.0) for s in sums]
    steep = (up[0] * up[0] + up[1] * up[1] > STEEP) | (up[2] < 0.0)
    steep = steep & (x.count > first + samples // 24)
    again, found = ~still | steep, running & still & (last | steep)
    # The shortest turn from up to z, (1 + up z, up x z)/sqrt(2 (1 + up z)), then one about z.
    half = ops.rsqrt(ops.bounded(2.0 + 2.0 * up[2], 0.0, 4.0, "of a unit vector"))
    w, a, b = (ops.saturated(s * half, 1.0) for s in (1.0 + up[2], up[0], up[1]))
    # East in level axes times up_z (1 + up_z), by the rule that east is across up.
    limit = _limit(samples, dt)
    high = limit / 256.0
    sums_east = [x.east_x, x.east_y]
    along, level = dot(up[:2], sums_east), up[2] + up[2] * up[2]
    east = [ops.saturated(level * e + u * along, high) for e, u in zip(sums_east, up, strict=False)]
    angle = ops.atan2_ht(east[1], ops.where(found, east[0], high))  # of no short vector
    sine, cosine = ops.sincos_ht(-0.5 * angle)
    turned = [cosine * w, cosine * b + sine * a, sine * b - cosine * a, sine * w]
    turned = [ops.saturated(e, 1.0) for e in turned]
    turned = [ops.saturated(e, 1.0) for e in product(turned, q)]

    t = (1.0 / samples) * (x.count + (samples + 1.5))
    weight = ops.saturated(t - t * t, 0.25)
    odd = 2.0 * t * weight - weight
    force = [ops.saturated(f, 2.0 * STEP_FORCE) for f in force]
    fresh = x.count < first + 0.5

    def total(sum_: Any, share: Any, high: float) -> Any:
        sum_ = ops.saturated(ops.where(fresh, 0.0, sum_) + share, high)
        return ops.bounded(sum_, -high, high * BELOW, "saturated")

    ups = [total(s, (1.0 / limit) * weight * f, 1.0) for s, f in zip(sums, force, strict=True)]
    return Alignment(
        running,
        found,
        turned,
        [
            (samples * samples / 40.0) * earth[0] * earth[1],
            *((0.5 * samples + 1.0) * w for w in earth),
        ],
        ops.where(again, first, x.count + 1.0),
        ups,
        {
            f"east_{axis}": total(getattr(x, f"east_{axis}"), odd * f, limit / 128.0)
            for axis, f in zip("xy", force, strict=False)
        },
    )
