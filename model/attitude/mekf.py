"""Multiplicative extended Kalman filter of six error states in navigation axes.

Nominal state: attitude q (body to navigation, ENU) and gyro bias b. Error state: a small rotation
d about the *navigation* axes, C_true = (I + [d]x) C, and the bias error in body axes::

    d' = -C db    Phi = [I, -C dt; 0, I]    Q = diag((gyro_var + gyro_scale_var |w|^2) dt,
                                                     bias_var dt)

Every measurement is a scalar along one axis of the attitude error, so no matrix is inverted:

* tilt: the specific force, turned to navigation axes and low-passed there (its three states turn
  with every correction), must point up: d_e = f_n/|f|, d_n = -f_e/|f|;
* heading: the field, turned likewise, must point north: d_u = m_e/m_h. Its variance grows with the
  squared deviation of the field (m_h, m_u) from a slow reference, the largest of late, in units of
  m_h: a disturbance of that size turns the heading by as much; and with P of the tilt, times
  tan^2(dip).

They take turns, one each time ``update_s`` has passed. A measurement that speaks for Dt seconds has
the variance var/Dt, so the same parameters hold at any sample rate::

    S = P_hh Dt + var      K = P_:h Dt / S      P <- P - K P_h:      dx = K z

At rest the bias goes to the low-passed gyro, b <- b + k (mean - b); with D = diag(1, 1, 1, 1-k,
1-k, 1-k) that makes P <- D P D + k rest_var, whatever k: P_bb tends to rest_var/2.

The first sample aligns it: force up, field north. The body is turned over first where it hangs
upside down, so that no turn that follows is near half a turn from none (1 + u >= 1, u the upper
component of the vertical)::

    level      (1 + u, n, -e, 0)        the shortest turn of the vertical (e, n, u) to the top
    to north   (1 + u + w_e, 0, 0, -w_n)   w = (1 + u) (east turned by that, its level components)
                                             = (1 + u) east_en - east_u (e, n)

the attitude of M. D. Shuster and S. D. Oh (1981), Three-axis attitude determination from vector
observations, J. Guidance and Control 4(1), found without a matrix.

Means begin young: with y one over their age they follow the faster, and Q grows by a multiple of
y^2, so that what was learnt from a bad first sample is forgotten.

An axis at full scale misses part of its rate, the more, the longer it is there: `BEYOND` times the
slope s with which it got there times that time. The slope is the rate's distance from its low-pass,
which stops meanwhile, times the corner. So the turn missed in a time T is 0.7 of the s T^2/6 that a
parabola has beyond full scale. Part of it stays unknown: the square of the missed rate makes the
means younger, so that the attitude follows the sensors the faster. A rate that jumps to full scale
from far below, which no body does, is false: the low-pass stands in.

Evidence and alternatives: `docs/systems/mekf.md`.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from boresight.model import ops
from boresight.model.algebra.angles import pitch_roll_heading_ht
from boresight.model.algebra.covariance import Symmetric, symmetric
from boresight.model.algebra.quaternion import cross, dot, matrix, product, turn
from boresight.model.algebra.quaternion_filter import named_outputs, status_word
from boresight.model.attitude.table import params_of
from boresight.model.errors import require_choice
from boresight.model.estimator import Estimator, State
from boresight.model.nine_axis import INPUTS, OUTPUTS

#: The bias error is carried as b times this, so that its covariance and that of the attitude are
#: of a size.
BIAS_SCALE = 64.0
#: Error states: attitude error about east, north, up [rad]; bias error in body axes, scaled.
AXES = ("e", "n", "u", "x", "y", "z")
PAIRS = tuple((i, j) for i in range(6) for j in range(i, 6))

#: No attitude yet, which status bit 0 says.
START = (("w", 1.0 - 2.0**-31), ("x", 0.0), ("y", 0.0), ("z", 0.0))

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "no attitude yet: no specific force so far",
    1: "heading not aligned: no magnetometer sample so far, or a field along the vertical",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field odd: it counts less than half as much as the undisturbed one",
    5: "at rest: the gyro's bias is measured",
    6: "the rate was at full scale within the last seconds: the attitude may be off",
}


def covariance_name(i: int, j: int) -> str:
    """Name of the stored element (i, j), i <= j."""
    return f"p_{AXES[i]}{AXES[j]}"


PARAMS = params_of(
    """
    gyro_var 3e-05 1e-06 0.0156 rad^2/s
        random walk of the attitude: small trusts the gyro, large the accelerometer and the
        magnetometer
    gyro_scale_var 2.4e-05 0 0.0039 s
        more of it per (rad/s)^2 of rotation: scale and alignment errors of the gyro
    bias_var 1.2e-07 3e-11 4e-07 (rad/s)^2/s
        random walk of the gyro's bias: small holds the learnt bias, large follows its drift
    tilt_var 0.00075 0.0001 1 rad^2*s
        noise of the low-passed vertical, variance times time: small trusts the
        accelerometer
    heading_var 0.001 0.0001 3.6 rad^2*s
        noise of the magnetic heading in the reference field, variance times time: small
        trusts the magnetometer
    rest_rate_per_s 0.3 0 4 1/s
        how fast the bias goes to the gyro's mean at rest; 0 never
    rest_var 1e-07 1e-09 6e-05 (rad/s)^2
        twice the variance of the bias learnt so
    force_rate_per_s 0.6 0.01 30 1/s
        corner of the low-pass of the specific force in navigation axes: small averages
        longer accelerations
    field_trust_s 0.28 0 1000 s
        how much the squared relative deviation of the field from its reference adds to
        heading_var: 0 trusts every field
    field_forget_per_s 0.4 0 30 1/s
        how fast a deviation of the field is forgotten once it is over
    field_follow_per_s 0.04 0 30 1/s
        how fast the reference follows the field: large adopts a new place soon, 0 never
    dip_trust_s 0.6 0 1000 s
        how much the variance of the tilt, times the squared tangent of the dip, adds to
        heading_var
    start_var 0.12 0 0.25 rad^2*s
        more random walk of the attitude while the means are young, over their squared age:
        large follows accelerometer and magnetometer at the start
    field_min_sq 4 0.1 4000 uT^2
        squared field below which there is no sample
    force_min_sq 4 0.1 80000 (m/s^2)^2
        squared low-passed specific force below which it is not used
    gyro_most_sq 1500 0.25 4800 (rad/s)^2
        square of a rate a little less than the gyro's full scale: what an axis misses
        beyond it is extrapolated, and the attitude follows the other sensors faster; one
        that jumps there from far below is not believed
    force_most_sq 12000 1 12000 (m/s^2)^2
        squared deviation of the specific force from its mean beyond which it says nothing:
        that of an accelerometer at full scale
    gyro_rate_per_s 30 0.01 60 1/s
        corner of the gyro's low-pass, which stops at full scale: its distance from the rate
        tells the slope there
    rest_motion_sq 0.4 0 900 (m/s^2)^2
        most squared motion at rest: the force's deviation from its mean; 23 m/s^2 stand for
        1 rad/s of the low-passed rate less the bias
    rest_time_s 0.4985 0 30 s
        how long that must last
    p0_bias 4.5e-05 1e-11 6e-05 (rad/s)^2
        variance of the gyro's bias at the start
    update_s 0.0087 0.004 0.24 s
        least time between two scalar updates
    """
)

STATES = (
    *(State(f"q{a}", -1.0, 1.0 - 2.0**-31, "", v) for a, v in START),
    *(State(f"bias_{a}", -0.25, 0.25 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    *(State(covariance_name(i, j), -1.95, 1.95, "") for i, j in PAIRS),
    *(State(f"force_{a}", -128.0, 128.0 * (1 - 2.0**-31), "m/s^2") for a in "enu"),
    *(State(f"field_{a}", -128.0, 128.0 * (1 - 2.0**-31), "uT") for a in "en"),
    State("field_u", -444.0, 444.0, "uT"),
    *(State(f"rate_{a}", -64.0, 64.0 * (1 - 2.0**-31), "rad/s") for a in "xyz"),
    State("horizontal", -1.0, 450.0, "uT", -1.0),  # of the reference field; -1: not known
    State("vertical", -450.0, 450.0, "uT"),
    State("youth", 0.0, 63.9, "1/s", 63.0),  # one over the age of the means
    State("odd_sq", 0.0, 2.0, ""),
    # whose turn it is, -1, 0, 1 first, second, third, and on top the time since the last one
    State("turn", -1.0, 1.5, "s", -1.0),
    # of the slope at full scale, the part that is missed by now
    State("beyond", 0.0, 1.0 - 2.0**-31, ""),
    State("fastest_sq", 0.0, 4800.0, "(rad/s)^2"),  # largest squared rate of late
    State("rest_s", -1.0, 32.0, "s", -1.0),  # for how long at rest; -1: tilt not known
    State("field_left", -0.25, 0.2499, "s"),  # for how long the field's direction is still used
)

#: Inputs, states and parameters that only a field needs, with their values without one.
FIELD_ONLY = {
    **{f"m{a}": 0.0 for a in "xyz"},
    **{f"field_{a}": 0.0 for a in "enu"},
    **{"horizontal": -1.0, "vertical": 0.0, "odd_sq": 0.0, "field_left": -1.0},
    **{
        q.name: q.default
        for q in PARAMS
        if q.name.startswith(("field_", "heading_")) or q.name == "dip_trust_s"
    },
}


TRACE_LIMIT = 1.6  #: rad^2 and scaled bias^2, trace of P from which on it grows no more.
GROWTH_LIMIT = 0.125  #: largest growth of a variance in one prediction.
P0_TILT, P0_HEADING = 0.07, 0.05  #: rad^2, variances of the first attitude.


def element(value: Any) -> Any:
    """An element of P, or of a row of it that was scaled down."""
    return ops.bounded(value, -1.95, 1.95, "element of P, of limited trace")


def predicted(
    P: Symmetric,
    gain: Any,
    column: Any,
    C: Any,
    step: Any,
    starts: tuple[Any, Any],
    keep: Any,
    rest_gain: Any,
    attitude: Any,
    growth: Any,
    p: Any,
) -> Symmetric:
    """Update, then predict: Phi (P - K P_h:) Phi^T + Q, Phi = [I, -A; 0, I], A = C step.

    P0 of the attitude, and of the bias, where ``starts``. No growth while the trace is beyond
    `TRACE_LIMIT`, which is more than three biases of the largest p0_bias, so that measurements
    always end that.

    ``gain`` and ``column`` are K (6,) and the row P_h: (6,) of the axis measured, biases times
    `BIAS_SCALE`; ``step`` is the time since the last update [s]; ``keep`` and ``rest_gain`` are 1 -
    k and k, the share of the bias that a gyro at rest leaves and gives; ``attitude`` is the random
    walk of the attitude [rad^2/s], ``growth`` what youth adds to it.
    """
    trace = P[0][0] + P[1][1] + P[2][2] + P[3][3] + P[4][4] + P[5][5]
    step = ops.named("growth_step", ops.where(trace > TRACE_LIMIT, 0.0, step))
    A = [[c * (step * (1.0 / BIAS_SCALE)) for c in row] for row in C]
    added = ops.saturated(attitude * step + growth * step, GROWTH_LIMIT)
    walk = BIAS_SCALE * BIAS_SCALE * (p.bias_var * step + p.rest_var * rest_gain)
    p0 = (P0_TILT, P0_TILT, P0_HEADING, *(BIAS_SCALE * BIAS_SCALE * p.p0_bias,) * 3)
    factor = (1.0, keep, ops.named("rest_keep_sq", keep * keep))

    def updated(i: int, j: int) -> Any:
        return P[i][j] * factor[(i > 2) + (j > 2)] - gain[i] * column[j]

    # P_bb' = P_bb + Q_b, P_tb' = P_tb - A P_bb', P_tt' = P_tt - A P_tb'^T - P_tb' A^T + Q_t:
    # the last is more by A P_bb' A^T, some 1e-9 rad^2, than the exact product, and so positive.
    bias = symmetric(
        3,
        lambda i, j: element(
            ops.where(
                starts[1],
                p0[3 + i] if i == j else 0.0,
                updated(3 + i, 3 + j) + (walk if i == j else 0.0),
            )
        ),
    )
    across = [
        [
            element(ops.where(starts[0], 0.0, updated(i, 3 + k) - dot(A[i], bias[k])))
            for k in range(3)
        ]
        for i in range(3)
    ]

    def tilt(i: int, j: int) -> Any:
        if i == j:
            value = updated(i, i) - 2.0 * dot(A[i], across[i]) + added
        else:
            value = updated(i, j) - dot(A[i], across[j]) - dot(across[i], A[j])
        return element(ops.where(starts[0], p0[i] if i == j else 0.0, value))

    top = symmetric(3, tilt)
    return [[*top[i], *across[i]] for i in range(3)] + [
        [*(across[i][k] for i in range(3)), *bias[k]] for k in range(3)
    ]


FORGET_BELOW_S, ANEW_BELOW_S = -0.245, -0.2  #: time steps, see `Mekf.step`.
LONGEST_STEP_S = 0.25  #: a step below zero is that much less than the gap.
GAP_VAR = 0.2  #: s, random walk of the attitude in a gap, per (rad/s)^2 after it.
NOISE_FLOOR = 1e-4  #: least variance of a measurement: the square of the least legal sd.
NOISE_LIMIT = 4.0  #: largest.
SPAN_LIMIT = 0.5  #: s, longest time that one measurement speaks for.
GAIN_LIMIT = 127.0  #: sqrt(P_ii Dt) / (2 sd) is less than that.
BIAS_LIMIT = 0.25  #: rad/s.
HALF_STEP_LIMIT = 0.5  #: rad, half of the largest turn about an axis in one sample.
INCREMENT = 0.37  #: norm of a step's quaternion: times 1.33 and `HALF_STEP_LIMIT` below 1/4.
CORRECTION_LIMIT = 0.5  #: rad, largest correction of one update.
FORCE_LIMIT = 128.0  #: m/s^2, largest component of the mean force.
FORCE_STEP_LIMIT = 64.0  #: m/s^2, largest deviation from the mean force that counts.
OFF_LIMIT = 4.0  #: rad/s, the largest low-passed rate less the bias that counts.
RATE_LIMIT = 64.0  #: rad/s, largest low-passed rate.
MEAN_WEIGHT = 512.0  #: (m/s^2)^2 of motion that (1 rad/s)^2 of the rate less the bias stand for.
HORIZONTAL_LIMIT = 128.0  #: uT, largest horizontal component of the field.
HORIZONTAL_SQ_LIMIT = 16384.0  #: uT^2, its largest square: the less, the finer a weak one's.
STEEP = 16.0  #: vertical over horizontal field from which on it tells no heading.
FIELD_AGE_LIMIT = 0.25  #: s, age from which on the field's direction is not used.
FIELD_AGE = 0.2499  #: s, what is left of it with a new field: less, so that it needs no clamp.
FIRST_FORCE_LIMIT = 64.0  #: m/s^2, largest component of the first force that is used.
FIRST_FIELD_LIMIT = 128.0  #: uT, the same of the first field.
WALK_LIMIT = 1.0  #: rad^2/s, largest random walk of the attitude.
#: A rate is a jump if its square exceeds the largest of late by this part of gyro_most_sq.
JUMP = 0.875
FASTEST_FORGET = 0.25  #: 1/s, how fast the largest squared rate of late is forgotten.
LATE = 0.5  #: part of gyro_most_sq: a rate was at full scale of late while the largest exceeds it.
#: The rate missed at full scale grows by this part of the slope: 0.7 of a parabola's turn.
BEYOND = 0.7 / 3.0
#: (m/s^2)^2, squared change of the force from which on it carries no information about a turn.
GENTLE_SQ = 200.0
MISSED_SQ_LIMIT = 64.0  #: (rad/s)^2, largest square of a missed rate that counts.
FULL_YOUTH = 4.0  #: s, how fast youth grows per squared missed rate, in (rad/s)^2.
HEADING_LIMIT = 0.5  #: rad^2, variance from which on a heading that nothing tells gets no worse.
#: 1/s, one over the age of a mean: at its start, the most that adds to the covariance, how much
#: faster than its exponential it ends; and by how much more than a plain mean followers follow.
YOUTH_START, YOUTH_LIMIT, YOUTH_ENDS = 63.0, 8.0, 0.5
FORCE_YOUTH, FIELD_YOUTH = 1.7, 24.0
MEMORY_YOUTH = 4.0  #: by how much the memory of the field's deviation is forgotten at any time.
YOUTH_LSB = 2.0**-20  #: 1/s, what youth loses in a sample at least, so that it ends.


def _vector(x: Any, name: str, axes: str) -> tuple[Any, Any, Any]:
    first, second, third = (getattr(x, f"{name}_{a}") for a in axes)
    return first, second, third


def _increment(half: Any) -> tuple[Any, Any, Any, Any]:
    """Quaternion along (cos, sin) of the angle |half| [rad], of norm about 0.37: 0.37 (1, tan).

    tan(y)/y = 1 + y^2/3 + 2 y^4/15 + ...; the next term, 0.054 y^6, is below 1e-9 up to 0.1 rad in
    a sample and 3e-7 at 0.27. By a power of two, steps whose series is 1 would lose a bit and be
    rounded up: 4e-6 deg/s at rest.
    """
    y = ops.bounded(dot(half, half), 0.0, 0.75, "three squares")
    t = INCREMENT + (INCREMENT / 3.0) * y + (2.0 * INCREMENT / 15.0) * (y * y)
    t = ops.bounded(t, INCREMENT, 1.33 * INCREMENT, "series")
    return (INCREMENT, *(ops.bounded(t * c, -0.2499, 0.2499, "tangent") for c in half))


def _excess(a: Any, b: Any) -> Any:
    """a - b, as a decision needs it: with all its bits near zero, at most 1."""
    return ops.saturated(a - b, 1.0)


def _turned_over(over: Any, v: Any, limit: float) -> tuple[Any, Any, Any]:
    """A vector in body axes, half a turn about x where ``over``; components within the limit."""
    x, y, z = v
    turned = (x, ops.flip(over, y), ops.flip(over, z))
    return tuple(ops.saturated(c, limit) for c in turned)


def _turns(
    anew: Any, up: Any, east: Any, cosine: Any, sine: Any
) -> tuple[tuple[Any, ...], tuple[Any, Any]]:
    """Level quaternion, and w and z of the turn about the vertical to north.

    Where ``anew`` holds, of the unit vectors ``up`` and ``east``; else the turn is that of the
    cosine and sine. Norms 1.4 to 2 and 0.7 to 2. Of tan(a/2) = sin(a)/(1 + cos(a)) =
    (1 - cos(a))/sin(a), the form that is far from 0/0 is taken.
    """
    top = 1.0 + up[2]
    size = ops.where(anew, 0.5 * top, 1.0)
    cosine = ops.where(anew, 0.5 * (top * east[0] - east[2] * up[0]), cosine)
    sine = ops.where(anew, 0.5 * (east[2] * up[1] - top * east[1]), sine)
    cosine, sine = ops.saturated(cosine, 1.0), ops.saturated(sine, 1.0)
    behind = cosine < 0.0
    turn = (ops.where(behind, sine, size + cosine), ops.where(behind, size - cosine, sine))
    return (top, up[1], -up[0]), turn


class Mekf(Estimator):
    """Six-state error-state Kalman filter with soft trust in the magnetic field."""

    name = "mekf"
    summary = "multiplicative EKF: attitude and gyro bias, six error states, any sample rate"
    inputs = INPUTS
    params = PARAMS
    states = STATES
    outputs = OUTPUTS
    restarts = True
    bridges_s = LONGEST_STEP_S - ANEW_BELOW_S
    start_deg = {18: 0.5, 20: 0.15, 22: 0.04, 23: 0.02}
    status_bits = STATUS_BITS
    urgent = 7  # Euler angles and quaternion; the status word may follow
    magnetic = True

    def __init__(self, mag: str = "full") -> None:
        """With ``mag`` "none" without a magnetometer: the heading is free, all else the same.

        Its name is then ``mekf_six_axis``. `InputError`: ``mag`` is neither "full" nor "none".
        """
        require_choice("mekf, mag", mag, ("full", "none"))
        self.magnetic = mag == "full"
        if not self.magnetic:
            self.name = "mekf_six_axis"
            self.summary = "mekf without a magnetometer: the heading is free"
            self.inputs = tuple(i for i in INPUTS if i.name not in FIELD_ONLY)
            self.params = tuple(p for p in PARAMS if p.name not in FIELD_ONLY)
            self.states = tuple(s for s in STATES if s.name not in FIELD_ONLY)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample: update with the means of earlier samples, then predict with this one."""
        nothing = 0.0 * u.dt
        if not self.magnetic:  # what these decide is left out of the program
            dark = {name: nothing + value for name, value in FIELD_ONLY.items()}
            x, u, p = (SimpleNamespace(**{**dark, **vars(values)}) for values in (x, u, p))
        field, force = (u.mx, u.my, u.mz), (u.ax, u.ay, u.az)
        bias, rate = _vector(x, "bias", "xyz"), _vector(x, "rate", "xyz")
        # A new start, of all states or of all but the bias; or a gap of known length.
        since_last = ops.where(x.rest_s < 0.0, -LONGEST_STEP_S, u.dt)
        forgotten, leveling = since_last < FORGET_BELOW_S, since_last < ANEW_BELOW_S
        gap = u.dt < 0.0
        dt = ops.saturated(ops.where(gap, LONGEST_STEP_S - u.dt, u.dt), 0.5)
        dt = ops.named("step", ops.saturated(ops.where(leveling, 0.0, dt), 0.5))
        enough_field = _excess(dot(field, field), p.field_min_sq)
        no_field = enough_field < 0.0

        # An axis at full scale: the rate missed is the time there, in units of `BEYOND`, times the
        # slope, the rate's distance from its low-pass r. A jump is false: w - (w - r) stands in.
        gyro = (u.gx, u.gy, u.gz)
        speed_sq = ops.named("speed_sq", dot(gyro, gyro))
        jumped = speed_sq - x.fastest_sq > JUMP * p.gyro_most_sq
        late = LATE * p.gyro_most_sq < x.fastest_sq
        slope = [
            ops.where(p.gyro_most_sq < w * w, w - c, 0.0) for w, c in zip(gyro, rate, strict=True)
        ]
        slope_sq = dot(slope, slope)
        r_share = p.gyro_rate_per_s * dt
        r_follow = ops.where(-slope_sq < 0.0, 0.0, -r_share)
        r_follow = ops.saturated(ops.where(leveling, -1.0, r_follow), 1.0)
        beyond = ops.where(jumped, -1.0, x.beyond)
        beyond_after = ops.where(r_follow < 0.0, 0.0, x.beyond + BEYOND * r_share)
        beyond_after = ops.saturated(beyond_after, 1.0)
        beyond_dt = beyond * dt
        stale = ~(ops.where(leveling, enough_field, x.field_left) > 0.0)
        heading_unknown = leveling | (x.horizontal < 0.0)
        # At a new start without a field the old attitude is better than none.
        anew = leveling & (~no_field | (x.rest_s < 0.0))
        no_heading, aligning = heading_unknown | stale, heading_unknown & ~stale

        # Whose turn: one-hot weights (h_1, h_2, h_3) of the axis -1, 0, 1; the time since the last.
        heading_turn = x.turn >= 1.0
        first, last = ops.where(x.turn < 0.0, 1.0, 0.0), ops.where(heading_turn, 1.0, 0.0)
        h = (first, ops.bounded(1.0 - first - last, 0.0, 1.0, "one of three"), last)
        since = ops.bounded(x.turn + first - last + dt, 0.0, 1.0, "two steps at most")
        since = ops.named("since", since)
        update_due = since >= p.update_s
        step = ops.named("update_step", ops.where(update_due, since, 0.0))

        # Directions of the mean force and of the field of the last sample; at the first one those
        # of itself, half a turn about x where it hangs upside down.
        over = force[2] < 0.0
        f_first = _turned_over(over, force, FIRST_FORCE_LIMIT)
        m_first = _turned_over(over, field, FIRST_FIELD_LIMIT)
        pairs = zip(f_first, _vector(x, "force", "enu"), strict=True)
        f = [ops.where(anew, first, mean) for first, mean in pairs]
        m = _vector(x, "field", "enu")
        eighth = [0.125 * c for c in f_first]
        east = [ops.saturated(c, FIRST_FIELD_LIMIT) for c in cross(m_first, eighth)]
        f_sq, m_sq = dot(f, f), m[0] * m[0] + m[1] * m[1]
        enough_force = _excess(f_sq, p.force_min_sq)
        no_vertical = enough_force < 0.0
        f_inverse = ops.rsqrt(f_sq)
        m_length = ops.saturated(ops.where(anew, dot(east, east), m_sq), HORIZONTAL_SQ_LIMIT)
        m_inverse = ops.rsqrt(m_length) if self.magnetic else nothing
        up = [ops.saturated(c * f_inverse, 1.0) for c in f]
        sine, cosine = (ops.saturated(c * m_inverse, 1.0) for c in m[:2])
        east = [ops.saturated(c * m_inverse, 1.0) for c in east]
        level, yaw = _turns(anew, up, east, cosine, sine)

        # How odd the field is: squared deviation from the reference over the horizontal field,
        # the most of late.
        change = (ops.saturated(m_sq * m_inverse, 256.0) - x.horizontal, m[2] - x.vertical)
        odd = tuple(ops.saturated(d * m_inverse, 1.0) for d in change)
        odd_now = ops.bounded(
            ops.where(heading_unknown, 0.0, dot(odd, odd)), 0.0, 2.0, "two squares"
        )
        odd_now = ops.named("odd_now", odd_now)
        young = ops.saturated(ops.where(gap, speed_sq, x.youth), 64.0)
        grown = ops.named("grown", ops.saturated(young * dt, 0.5))
        # The reference survives a rate at full scale: it distinguishes the field from a magnet's.
        # The memory does not: while the attitude was off, every field was odd.
        settling = ops.where(late, 0.0, grown)
        forget = p.field_forget_per_s * dt + FIELD_YOUTH * settling + MEMORY_YOUTH * grown
        forget = ops.saturated(forget, 1.0)
        odd_sq = ops.maximum(odd_now, x.odd_sq - forget * x.odd_sq)
        odd_sq = ops.named("odd", ops.bounded(odd_sq, 0.0, 2.0, "a part of it"))

        # At rest the low-passed rate is the bias: b <- b + k (r - b), one gain k on all axes.
        off = [ops.saturated(r - b, OFF_LIMIT) for r, b in zip(rate, bias, strict=True)]
        resting = p.rest_time_s < x.rest_s
        rest_gain = ops.named(
            "rest_gain", ops.where(resting, ops.saturated(p.rest_rate_per_s * step, 0.5), 0.0)
        )
        keep = ops.named("rest_keep", 1.0 - rest_gain)

        # Beyond a right angle the heading is off by that at least; unknown without a field.
        turn_off = ops.where(m[1] < 0.0, ops.where(m[0] < 0.0, -1.0, 1.0), sine)
        turn_off = ops.where(no_heading, 0.0, turn_off)

        # Innovation, its variance and the time Dt it speaks for, for the axis whose turn it is.
        innovation = ops.named(
            "innovation",
            ops.bounded(h[0] * up[1] - h[1] * up[0] + h[2] * turn_off, -1.0, 1.0, "one of three"),
        )
        dip = ops.saturated(m[2] * m_inverse, 4.0)
        odd_var = ops.named("odd_var", ops.saturated(p.field_trust_s * odd_sq, NOISE_LIMIT))
        trusted = p.heading_var + odd_var + p.dip_trust_s * (dip * dip * x.p_nn)
        trusted = ops.saturated(trusted, NOISE_LIMIT)
        variance = ops.where(heading_turn, ops.where(no_heading, NOISE_LIMIT, trusted), p.tilt_var)
        # Below zero nothing is measured: a heading without information, no vertical.
        idle = ops.where(no_heading, x.p_uu - HEADING_LIMIT, 0.0)
        measured = ops.where(heading_turn, idle, enough_force)
        span = ops.where(measured < 0.0, 0.0, 3.0 * step)
        span = ops.named("span", ops.saturated(span, SPAN_LIMIT))

        # Scalar update: gain and correction; P itself below.
        P = symmetric(6, lambda i, j: getattr(x, covariance_name(i, j)))
        column = [element(dot(h, P[i][:3])) for i in range(3)]
        column += [element(keep * element(dot(h, P[i][:3]))) for i in range(3, 6)]
        total = ops.bounded(
            dot(h, column[:3]) * span + variance, NOISE_FLOOR, 7.99, "at least the noise"
        )
        scale = ops.bounded(span / total, 0.0, SPAN_LIMIT / NOISE_FLOOR, "Dt / S")
        gain = [
            ops.bounded(c * scale, -GAIN_LIMIT, GAIN_LIMIT, "sqrt(P_ii Dt) / (2 sd)")
            for c in column
        ]
        turned = tuple(ops.saturated(k * innovation, CORRECTION_LIMIT) for k in gain[:3])
        learnt = [
            ops.saturated(
                ops.where(forgotten, 0.0, b + rest_gain * o + k * (1.0 / BIAS_SCALE) * innovation),
                BIAS_LIMIT,
            )
            for b, o, k in zip(bias, off, gain[3:], strict=True)
        ]

        # Attitude: correction (or alignment), then the gyro's step, then |q| = 1.
        correction = self._correction(anew, aligning, level, yaw, turned)
        half = tuple(
            ops.saturated(0.5 * (w * dt + beyond_dt * s - b * dt), HALF_STEP_LIMIT)
            for w, s, b in zip(gyro, slope, bias, strict=True)
        )
        first = (ops.where(over, 0.0, 1.0), ops.where(over, 1.0, 0.0), 0.0, 0.0)
        pairs = zip(first, (getattr(x, f"q{a}") for a in "wxyz"), strict=True)
        before = [ops.saturated(ops.where(anew, start, old), 1.0) for start, old in pairs]
        q = tuple(ops.saturated(c, 1.0) for c in product(before, _increment(half)))
        q = tuple(ops.saturated(c, 1.0) for c in product(correction, q))
        norm = ops.rsqrt(ops.bounded(dot(q, q), 0.0, 1.0, "norms of at most 1.1, 0.57 and 1"))
        q = tuple(ops.saturated(c * norm, 1.0) for c in q)
        C = matrix(q)
        pitch, roll, heading = pitch_roll_heading_ht(C)

        scale_var = ops.where(gap, GAP_VAR, p.gyro_scale_var)
        walk = ops.saturated(p.gyro_var + scale_var * speed_sq, WALK_LIMIT)
        youth = ops.saturated(young, YOUTH_LIMIT)
        growth = p.start_var * (youth * youth)
        starts = (leveling, forgotten)
        after = predicted(P, gain, column, C, step, starts, keep, rest_gain, walk, growth, p)

        # Low-passes: force and field in navigation axes, rate in body axes.
        f_change = [
            ops.saturated(a - c, FORCE_STEP_LIMIT) for a, c in zip(turn(C, force), f, strict=True)
        ]
        f_rate = p.force_rate_per_s * dt + FORCE_YOUTH * grown
        # A force that is as far off as full scale carries no information: the mean stays.
        change_sq = dot(f_change, f_change)
        # Part of what was missed at full scale is unknown: the means grow younger again, unless
        # the force is far from gravity.
        missed_sq = ops.saturated((beyond * beyond) * slope_sq, MISSED_SQ_LIMIT)
        missed_sq = ops.where(change_sq < GENTLE_SQ, missed_sq, 0.0)
        ending = ops.saturated(grown + YOUTH_ENDS * dt, 0.5)
        older = young - young * ending - YOUTH_LSB + (FULL_YOUTH * dt) * missed_sq
        older = ops.saturated(older, 64.0)
        older = ops.saturated(ops.where(older < 0.0, 0.0, older), 64.0)  # of one format: no tie
        f_rate = ops.where(p.force_most_sq < change_sq, 0.0, f_rate)
        f_follow = ops.saturated(ops.where(leveling, 1.0, f_rate), 1.0)
        f_after = [
            ops.saturated(c + f_follow * d + t, FORCE_LIMIT)
            for c, d, t in zip(f, f_change, cross(turned, f), strict=True)
        ]
        m_after = [
            ops.where(no_field, old, new) for old, new in zip(m, turn(C, field), strict=True)
        ]
        m_after[:2] = [ops.saturated(c, HORIZONTAL_LIMIT) for c in m_after[:2]]
        r_keep = 1.0 + r_follow
        r_after = [
            ops.saturated(r_keep * c - r_follow * w, RATE_LIMIT)
            for w, c in zip(gyro, rate, strict=True)
        ]

        # Reference of the field; its horizontal part is negative until the heading is known.
        follow = p.field_follow_per_s * dt + FIELD_YOUTH * settling
        follow = ops.saturated(ops.where(heading_unknown, 1.0, follow), 1.0)
        horizontal = x.horizontal + ops.where(stale, 0.0, follow * change[0])
        horizontal = ops.where(leveling, -1.0, horizontal)
        horizontal = ops.bounded(horizontal, -1.0, 450.0, "a mean of magnitudes")
        vertical = ops.bounded(x.vertical + follow * change[1], -450.0, 450.0, "a mean of fields")

        # Rest: the force keeps near its mean, and the low-passed rate can be a bias.
        motion = change_sq + MEAN_WEIGHT * dot(off, off)
        at_rest = _excess(motion, p.rest_motion_sq) < 0.0
        rest_s = ops.saturated(ops.where(at_rest, x.rest_s + dt, 0.0), 32.0)
        rest_s = ops.where(leveling & no_vertical, -1.0, ops.where(leveling, 0.0, rest_s))

        # That field is turned by the old heading: after an alignment it is not used again.
        remaining = ops.where(heading_unknown, 0.0, x.field_left) - dt
        field_left = ops.saturated(remaining, FIELD_AGE_LIMIT)
        # The fastest of late; a jump is none.
        slower = ~forgotten & (ops.where(jumped, -1.0, speed_sq - x.fastest_sq) < 0.0)
        forgotten_sq = x.fastest_sq - FASTEST_FORGET * dt * x.fastest_sq

        steep = STEEP * x.horizontal < ops.absolute(x.vertical)
        flags = (
            leveling & no_vertical,
            (heading_unknown & stale) | (steep & ~heading_unknown),
            no_vertical,
            no_field,
            p.heading_var < odd_var,
            resting,
            late,
        )
        status = status_word(dict(enumerate(flags)))

        states = {
            **{f"q{a}": c for a, c in zip("wxyz", q, strict=True)},
            **{f"bias_{a}": b for a, b in zip("xyz", learnt, strict=True)},
            **{covariance_name(i, j): after[i][j] for i, j in PAIRS},
            **{f"force_{a}": v for a, v in zip("enu", f_after, strict=True)},
            **{f"field_{a}": v for a, v in zip("enu", m_after, strict=True)},
            **{f"rate_{a}": v for a, v in zip("xyz", r_after, strict=True)},
            "horizontal": horizontal,
            "vertical": vertical,
            "youth": ops.where(leveling | aligning, YOUTH_START, older),
            "odd_sq": odd_sq,
            "turn": ops.bounded(
                ops.where(leveling, -1.0, ops.where(update_due, h[1] - h[2], x.turn + dt)),
                -1.0,
                1.5,
                "one of three, and a time",
            ),
            "fastest_sq": ops.where(slower, forgotten_sq, speed_sq),
            "beyond": beyond_after,
            "rest_s": rest_s,
            "field_left": ops.where(no_field, field_left, FIELD_AGE),
        }
        out = named_outputs((pitch, roll, heading), q, status)
        names = {s.name for s in self.states}
        return {name: value for name, value in states.items() if name in names}, out

    @staticmethod
    def _correction(anew: Any, aligning: Any, level: Any, yaw: Any, turned: Any) -> list[Any]:
        """Quaternion of norm 0.2 to 1.1 that turns the attitude about navigation axes.

        The product of ``yaw`` about the vertical, where the heading aligns, and of ``level``
        at the first sample, then of the correction (1, d/2).
        """
        a = [
            ops.where(aligning, component, identity)
            for component, identity in zip(yaw, (2.0, 0.0), strict=True)
        ]
        b = [
            ops.where(anew, first, later)
            for first, later in zip((*level, 0.0), (2.0, *turned), strict=True)
        ]
        return [
            0.25 * (a[0] * b[0] - a[1] * b[3]),
            0.25 * (a[0] * b[1] - a[1] * b[2]),
            0.25 * (a[0] * b[2] + a[1] * b[1]),
            0.25 * (a[0] * b[3] + a[1] * b[0]),
        ]
