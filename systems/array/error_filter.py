"""The 13 error states and their interface: propagation, and one scalar update in a sample.

They are propagated once a second or at an index.

x = (dv 3, dku, phi 3, eps 3, nabla 3): errors of the strapdown, phi with C_true = (1 + phi x) C,
instruments' errors in the body. Over T seconds, in which C is taken half way::

    dv  += T (g (-phi_n, phi_e, 0) + C nabla)
    phi += -T w_ie x phi - T C eps - (0, 0, angle turned about up) dku

What the transport rate and the Coriolis force do to errors of some mm/s is below the noise words.
"""

from __future__ import annotations

import math
from typing import Any

from boresight import Input, Output, Param, State, ops
from boresight.model.algebra import strapdown
from boresight.model.algebra.carried import BELOW
from boresight.model.algebra.covariance import Symmetric, covariance_states, sheared
from boresight.model.algebra.quaternion import Vector, dot, scaled_matrix
from boresight.model.algebra.scalar_update import Measured, Update
from boresight.model.algebra.strapdown import AXES, Angles, Sample
from boresight.model.declarations import MICRO_G

ARCSEC = math.pi / 648000.0  #: rad; a degree an hour is as many rad/s.

#: Errors of the instruments: name, largest that is learnt, unit.
_LEARNT = (
    ("scale_up", 2.0**-11, ""),
    *((f"eps_{a}", 2.0**-17, "rad/s") for a in AXES),
    *((f"nabla_{a}", 2.0**-5, "m/s^2") for a in AXES),
)
#: Name and limit of those, by number of the filter's state.
LEARNT = {k: row[:2] for k, row in zip((3, *range(7, 13)), _LEARNT, strict=True)}

#: The states of the filter, by kind.
KINDS = (*["velocity"] * 3, "scale", "tilt", "tilt", "heading", *["gyro"] * 3, *["force"] * 3)
#: The unit that each kind is held in: variances stay below one.
UNITS = {
    "velocity": 2.0**-4,  # m/s
    "scale": 2.0**-15,
    "tilt": 64.0 * ARCSEC,  # rad
    "heading": 304.0 * ARCSEC,  # rad
    "gyro": 2.0**-23,  # rad/s
    "force": 2.0**-7,  # m/s^2
}
WIDEST = 0.7  #: largest first standard deviation, in these units.
#: Initial standard deviations, and their units.
FIRST = {
    "velocity": (0.01, "m/s"),
    "scale": (2e-5, ""),
    "tilt": (20.0 * ARCSEC, "rad"),
    "heading": (60.0 * ARCSEC, "rad"),
    "gyro": (0.006 * ARCSEC, "rad/s"),
    "force": (120.0 * MICRO_G, "m/s^2"),
}

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no index is used",
    1: "erection: no index is used, accelerometer biases are known no longer",
    2: "an index came before the array worked: not used",
    3: "an index was beyond the gate or too soon after another one: not used",
    4: "an increment is at or beyond full scale",
    5: "variance of the heading at its limit",
    6: "an index was used",
    7: "no index for one turn and a half, or none yet",
    8: "the attitude is not known yet: the array must rest",
}

INPUTS = (
    *strapdown.INPUTS,
    Input("phase", -1.0, 3.0, meaning="-1 begin anew, 0 at rest, 1 being erected, 2 turning"),
    Input("azimuth", -1.0, 1.0, "ht", missing="hold", meaning="of the turntable at its index"),
    Input("index_time", 0.0, 1.0, missing="hold", meaning="when: 0 begin, 1 end of the sample"),
    Input("index", 0.0, 1.0, valid_of=("azimuth", "index_time"), meaning="1: the index was passed"),
)


def filter_params(align: int) -> tuple[Param, ...]:
    """First covariance, noises, gates; ``align``: samples of the alignment."""
    first = FIRST | ({"tilt": (12.0 * ARCSEC, "rad")} if align else {})
    meaning = "error at first: large follows the first measurements"
    return (
        *(
            Param(f"p0_{k}", value, 0.0, WIDEST * UNITS[k], unit, f"{k} {meaning}")
            for k, (value, unit) in first.items()
        ),
        Param("erected_force", 300.0 * MICRO_G, 0.0, 5e-3, "m/s^2", "bias after the erection"),
        Param("gyro_noise", 1.5e-7, 0.0, 3e-5, "rad/sqrt(s)", "angle walk: small trusts the gyro"),
        Param("force_noise", 5e-5, 0.0, 2e-3, "m/s/sqrt(s)", "velocity walk"),
        Param("gyro_walk", 0.0, 0.0, 1e-9, "rad/s/sqrt(s)", "of the bias: small keeps it"),
        Param("force_walk", 0.0, 0.0, 1e-4, "m/s^2/sqrt(s)", "of the bias: small keeps it"),
        Param("zupt_sd", 2e-3, 5e-4, 2.0**-7, "m/s", "of the velocity zero"),
        Param("index_sd", 1.43 * ARCSEC, 0.5 * ARCSEC, UNITS["heading"], "rad", "of an index"),
        Param("index_gate", 20.0, 1.0, 100.0, "", "an index further off, in deviations, waits"),
        Param("index_turn", 1.0, 0.0, 2.0, "ht", "least turn between two indices"),
    )


def filter_states(
    start: list[float], first: list[float], rate: float, align: int, literal: bool
) -> tuple[State, ...]:
    """Instrument errors, covariance, and what the filter remembers from one second to the next.

    ``first``: variances, scaled, of the 13 states; ``align``: samples of the alignment.
    """
    return (
        *(State(name, -limit, limit * BELOW, unit) for name, limit, unit in _LEARNT),
        *covariance_states(13, lambda i: first[i]),
        State("count", -1.0 - align, rate, "", -1.0 - align if align else 0.0),
        State("late", 0.0, 1.0),  # P was last propagated at an index
        *(State(f"from_q{a}", -1.0, BELOW, "", c) for a, c in zip("wxyz", start, strict=True)),
        State("turned", -4.0, 4.0 * BELOW, "", 4.0 * BELOW),
        *([State("last_off", -1.0, BELOW, "ht")] if literal else []),
    )


#: Besides those of the strapdown.
OUTPUTS = (
    *(Output(f"eps_{a}", "rad/s", 2e-10) for a in AXES),
    *(Output(f"nabla_{a}", "m/s^2", 1e-5) for a in AXES),
    Output("scale_up", "", 5e-7),
    Output("status", "bits"),
)

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
