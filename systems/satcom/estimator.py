"""Attitude for a satellite antenna on a vehicle: EKF of quaternion and gyro bias, tracking error.

Patent CN104880189 (2015), with omissions and misprints corrected; navigation north-east-down,
body front-right-down, C = Rz(psi) Ry(theta) Rx(phi), specific force f (at rest C^T (0, 0, -g)).

* State q and gyro bias b: q <- q dq, Phi = [Phi_4, -(dt/2) Xi(q); 0, 1],
  Q = diag((dt/2)^2 sd^2 Xi Xi^T, density^2 dt).
* Roll and pitch measured from the specific force, phi = atan2(-fy, -fz), theta = asin(fx/g).
* Heading from a PI loop between the gyro and the tracking error, the heading ``beam`` that the
  antenna was pointed with less the true one::

      psi_PI' = (sin(phi) wy + cos(phi) wz)/cos(theta) - Kp e - Ki int(e)
      Kp = 2 damping cutoff    Ki = cutoff^2    e = e_psi + psi_PI - beam

  A sample of e counts for the time since the last one, at most a second.
* With a tracking sample Z = (phi, theta, psi), without one Z = (phi, theta).
* External acceleration where C f is off (0, 0, -g) by more than delta: then roll_sd and pitch_sd
  grow by ``adapt``.

**Basis.** As in `ekf_bias` P is kept in navigation axes, R(q)^T P R(q). The norm of q is known to
be one: setting it back is a projection, (1 - q q^T)/|q|, of the covariance too, which leaves half
the small rotation e about north, east, down and the bias: 6 x 6, and the same filter. With d = 2 e
in axes turned by the heading the Jacobians are unit vectors, each a scalar update::

    cos(theta) dphi = d_1    dtheta = d_2    cos(theta) dpsi = cos(theta) d_3 + sin(theta) d_1

**Scale.** P is held times (scale finer / 2)^2, with ``finer`` a power of two that follows the
trace: 1 at a restart, up to 32 once P is small. Rows and moves are over ``finer``, which makes
them those of a state so much larger.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from boresight import Estimator, Input, Output, Param, State, ops
from boresight.model.algebra import covariance
from boresight.model.algebra import quaternion_filter as parts
from boresight.model.algebra.angles import roll_pitch_heading_ht, unit_angle_ht
from boresight.model.algebra.covariance import part
from boresight.model.algebra.quaternion import dot, increment, matrix, multiply, right_matrix, turn
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require_choice

BIAS_UNIT = 4.0  #: s; the bias state of the covariance is bias times this.
P0_LIMIT = 0.5  #: largest initial standard deviation, scaled.
FINEST = 32.0  #: most by which the scale of the covariance grows.
BELOW = 1.0 - 2.0**-31
_DEG = 0.017453292519943295

NOISE_LIMIT = 4.0  #: largest measurement noise times scale / 2.
ADAPT_LIMIT = 1024.0  #: largest `adapt` times scale / 2.
STEP_LIMIT = 0.125  #: largest root of a process noise, as held.
LEAST_NOISE = 2.0**-31  #: least process noise of a record, as held: less is no word of P.
BIAS_LIMIT = 0.125  #: rad/s, largest bias that is learnt.
CORRECTION_LIMIT = 0.5  #: largest component of v in a correction (1, v): 53 degrees.
DRIFT_LIMIT = 0.125  #: half turns a second, largest drift of the heading loop.
SMALL, LARGE = 2.0**-6, 0.125  #: traces between which the covariance keeps its scale.
CUT_NOISE = 0.5  #: variance with which a heading at its limit is cut, scaled.
FAR = 1.0 / 90.0  #: half turns; an unknown tilt further off is corrected and still unknown.
VARIANTS = ("corrected", "printed")
#: Innovations over the root of their variance, of the three updates.
INNOVATIONS = tuple(Output(f"nu_{name}", "", 0.01) for name in ("roll", "pitch", "heading"))


class Satcom(Estimator):
    """Attitude of a vehicle under a satellite antenna.

    As printed, ``roll`` takes phi = -atan(fy/fz), the wrong sign in these axes, and ``detector``
    compares a_z - g with delta_z, always beyond it where down is positive. With ``innovations`` it
    also gives each innovation over the root of its variance S, which shows whether R and Q are
    consistent.
    """

    name = "satcom"
    summary = "satcom on the move: 7-state EKF, adaptive R, heading from the tracking error"
    inputs = (
        Input("dt", -0.25, 0.2499, "s", clamp=True, meaning="time step; below 0: begin anew"),
        *(Input(f"g{c}", -40.0, 40.0, "rad/s", meaning=f"body rate, axis {c}") for c in "xyz"),
        *(
            Input(f"a{c}", -160.0, 160.0, "m/s^2", meaning=f"specific force, body axis {c}")
            for c in "xyz"
        ),
        Input("e_psi", -0.5, 0.5, "rad", missing=0.0, meaning="tracking error, estimate - truth"),
        Input("beam", -1.0, 1.0, "ht", missing="hold", meaning="heading that it was measured at"),
        Input("tracking", 0.0, 1.0, valid_of=("e_psi", "beam"), meaning="1: a tracking sample"),
    )
    params = (
        Param("scale", 8.0, 1.0, 64.0, "", "of the first covariance: small allows large p0_sd, R"),
        Param("start_heading", 0.0, -1.0, 0.9999, "ht", "at a restart, of a found satellite"),
        Param("p0_sd", 0.063, 1e-4, 1.0, "rad", "first attitude: large follows the first samples"),
        Param("bias_p0_sd", 0.015, 1e-5, 0.1, "rad/s", "bias at first; times 4 scale at most 0.5"),
        Param("gyro_sd", 0.05 * _DEG, 0.0, 0.1, "rad/s", "gyro (root of Q): small trusts it"),
        Param("bias_density", 5e-6, 0.0, 0.01, "rad/s/sqrt(s)", "walk of the bias: small keeps it"),
        Param("roll_sd", 0.5 * _DEG, 3e-4, 1.0, "rad", "noise of the measured roll (root of R)"),
        Param("pitch_sd", 0.5 * _DEG, 3e-4, 1.0, "rad", "noise of the measured pitch (root of R)"),
        Param("heading_sd", 0.3 * _DEG, 3e-4, 1.0, "rad", "of the loop's heading (root of R)"),
        Param("adapt", 100.0, 1.0, 1000.0, "", "roll_sd and pitch_sd grow so under acceleration"),
        Param("tilt_known_sd", 1.5 * _DEG, 0.0, 1.0, "rad", "tilt less sure finds no acceleration"),
        Param("delta_x", 0.2, 0.01, 60.0, "m/s^2", "north acceleration that counts as external"),
        Param("delta_y", 0.2, 0.01, 60.0, "m/s^2", "the same, east"),
        Param("delta_z", 0.5, 0.01, 60.0, "m/s^2", "the same, down"),
        Param("cutoff", 0.5, 0.0, 8.0, "rad/s", "of the heading loop: small smooths"),
        Param("damping", 0.707, 0.1, 4.0, "", "of the heading loop"),
        Param("tracking_gate", 0.1, 1e-3, 0.5, "rad", "tracking error beyond it is not used"),
    )
    states = (
        State("qw", -1.0, BELOW, "", BELOW),
        *(State(f"q{axis}", -1.0, BELOW) for axis in "xyz"),
        *(State(f"bias_{axis}", -0.125, 0.125 * BELOW, "rad/s") for axis in "xyz"),
        *covariance.covariance_states(6, lambda i: 0.063504 if i < 3 else 0.2304),
        State("finer", 1.0, FINEST, "", 1.0),
        State("coarser", 1.0 / FINEST, 1.0, "", 1.0),
        State("heading_pi", -1.0, BELOW, "ht"),
        State("drift", -0.125, 0.125 * BELOW, "ht/s"),
        State("since", 0.0, 1.0, "s"),
    )
    outputs = (
        *(Output(name, "ht", 2.7e-5) for name in ("roll", "pitch", "heading")),
        *(Output(f"q{axis}", "", 5e-5) for axis in "wxyz"),
        *(Output(f"bias_{axis}", "rad/s", 1e-5) for axis in "xyz"),
        *(Output(f"rate_{axis}", "rad/s", 1e-5) for axis in "xyz"),
        Output("heading_pi", "ht", 2.7e-5),
        Output("status", "bits"),
    )
    restarts = True
    status_bits = {
        0: "external acceleration: roll and pitch are measured with the enlarged noise",
        1: "no tracking sample",
        2: "tracking sample not used: error beyond its gate",
        3: "covariance at its limit",
    }
    urgent = 7

    def __init__(
        self, roll: str = "corrected", detector: str = "corrected", *, innovations: bool = False
    ) -> None:
        for name, value in (("roll", roll), ("detector", detector)):
            require_choice(f"satcom, {name}", value, VARIANTS)
        self.printed_roll = roll == "printed"
        self.printed_detector = detector == "printed"
        if innovations:
            self.outputs = (*Satcom.outputs, *INNOVATIONS)

    def param_values(self, given: Mapping[str, float] | None = None) -> dict[str, float]:
        """As `Estimator.param_values`; also refuses what the filter would clamp at this ``scale``.

        `InputError`: unknown name, a value outside the legal range, or too large for ``scale``.
        """
        values = super().param_values(given)
        adapt = values["adapt"]
        limits = {
            "adapt": ADAPT_LIMIT / 0.5,
            "p0_sd": P0_LIMIT / 0.5,
            "bias_p0_sd": P0_LIMIT / BIAS_UNIT,
            "roll_sd": NOISE_LIMIT / (0.5 * adapt),
            "pitch_sd": NOISE_LIMIT / (0.5 * adapt),
            "heading_sd": NOISE_LIMIT / 0.5,
            "tilt_known_sd": 1.0 / 0.5,
            "gyro_sd": STEP_LIMIT / (0.5 * 0.25),
            "bias_density": STEP_LIMIT / BIAS_UNIT,
        }
        with_adapt = dict.fromkeys(("roll_sd", "pitch_sd"), f" and an adapt of {adapt:g}")
        parts.require_unclamped(values, limits, with_adapt)
        return values

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        restart = u.dt < 0.0
        dt = ops.where(restart, 0.0, u.dt)
        rate = [
            ops.saturated(w - b, 8.0)
            for w, b in ((u.gx, x.bias_x), (u.gy, x.bias_y), (u.gz, x.bias_z))
        ]
        dq = increment([ops.saturated(0.5 * (w * dt), 1.0) for w in rate], short=True)
        q = [ops.saturated(c, 1.0) for c in multiply((x.qw, x.qx, x.qy, x.qz), dq)]
        c_nb = matrix(q)

        # Cosine of the predicted pitch, sine and cosine of the heading.
        cosine_sq = c_nb[1][0] * c_nb[1][0] + c_nb[0][0] * c_nb[0][0]
        secant = ops.rsqrt(cosine_sq)
        cos_theta = ops.bounded(cosine_sq * secant, 0.0, 1.0, "cosine")
        sin_psi, cos_psi = (ops.saturated(c * secant, 1.0) for c in (c_nb[1][0], c_nb[0][0]))
        psi = unit_angle_ht(sin_psi, cos_psi)

        turn_down = ops.saturated((c_nb[2][1] * u.gy + c_nb[2][2] * u.gz) * secant, 64.0)
        loop = self._heading_loop(x, u, p, dt, turn_down * secant)
        used = loop["used"]

        # External acceleration, unless the tilt is not known itself.
        half_scale = 0.5 * p.scale
        held = covariance.covariance_of(x, 6)
        traces = [parts.sum_of(held[k][k] for k in block) for block in (range(3), range(3, 6))]
        full, bias_full = (trace >= parts.TRACE_LIMIT for trace in traces)
        fine_scale = half_scale * x.finer
        roots = p.gyro_sd * fine_scale, (2.0 * BIAS_UNIT) * p.bias_density * fine_scale
        a = self._predicted(held, c_nb, dt, roots, full, bias_full)
        known_sd = ops.saturated(p.tilt_known_sd * fine_scale, 1.0)
        tilt_known = a[0][0] + a[1][1] < known_sd * known_sd
        force = turn(c_nb, (u.ax, u.ay, u.az))
        down = force[2] - GRAVITY if self.printed_detector else force[2] + GRAVITY
        moving = tilt_known & (
            (ops.absolute(force[0]) > p.delta_x)
            | (ops.absolute(force[1]) > p.delta_y)
            | (ops.absolute(down) > p.delta_z)
        )

        # Innovations over 2, times cos(theta) where the Jacobian is.
        roll_sine, roll_cosine = c_nb[2][1], c_nb[2][2]  # times cos(theta)
        if self.printed_roll:
            off = u.az * roll_sine + u.ay * roll_cosine, u.ay * roll_sine - u.az * roll_cosine
        else:
            off = u.az * roll_sine - u.ay * roll_cosine, -(u.ay * roll_sine) - u.az * roll_cosine
        roll_off = unit_angle_ht(*off, ops.rsqrt(off[0] * off[0] + off[1] * off[1]))
        sine = ops.saturated(u.ax * (1.0 / GRAVITY), 1.0)
        cosine = ops.bounded(ops.sqrt(1.0 - sine * sine), 0.0, 1.0, "cosine")
        pitch_off = unit_angle_ht(
            sine * cos_theta + cosine * c_nb[2][0], cosine * cos_theta - sine * c_nb[2][0]
        )
        far = ~tilt_known & (roll_off * roll_off + pitch_off * pitch_off > FAR * FAR)
        heading_off = ops.wrap_ht(loop["heading_pi"] - psi)
        half_cosine = (0.5 * math.pi) * cos_theta

        # Noises over 2, scaled.
        tilt_scale = ops.where(moving, ops.saturated(p.adapt * half_scale, ADAPT_LIMIT), half_scale)
        r_roll, r_pitch, r_heading = (
            ops.bounded(root * root, 0.0, 16.0, "variance")
            for root in (
                ops.saturated(p.roll_sd * tilt_scale, NOISE_LIMIT) * cos_theta,
                ops.saturated(p.pitch_sd * tilt_scale, NOISE_LIMIT),
                ops.saturated(p.heading_sd * half_scale, NOISE_LIMIT) * cos_theta,
            )
        )

        # Scalar updates: roll, pitch, heading. Without tracking a covariance at its limit is cut
        # along the heading, without innovation, so that the gains of the tilt live on.
        east, north, level = (x.coarser * c for c in (sin_psi, cos_psi, cos_theta))
        rows = (
            {0: north, 1: east},
            {0: -east, 1: north},
            {0: -c_nb[2][0] * north, 1: -c_nb[2][0] * east, 2: level},
        )
        cut = full & ~used
        gains: list[list[Any]] = []
        moves: list[Any] = []
        parts.update_along(a, gains, moves, rows[0], r_roll, half_cosine * roll_off)
        parts.update_along(a, gains, moves, rows[1], r_pitch, (0.5 * math.pi) * pitch_off)
        r_heading = ops.where(cut, CUT_NOISE, r_heading)
        nu = half_cosine * heading_off
        parts.update_along(a, gains, moves, rows[2], r_heading, nu, used, used | full)

        # Correction, normalisation, restart.
        pulls = [x.coarser * m for m in moves]
        turns = [
            parts.sum_of(g[k] * m for g, m in zip(gains, pulls, strict=True)) for k in range(6)
        ]
        half = [ops.saturated(t, CORRECTION_LIMIT) for t in turns[:3]]
        q_new, _ = parts.normalised(multiply([1.0, *half], q), 2.0)
        bias = [
            ops.saturated(ops.where(restart, 0.0, b + (1.0 / BIAS_UNIT) * t), BIAS_LIMIT)
            for t, b in zip(turns[3:], (x.bias_x, x.bias_y, x.bias_z), strict=True)
        ]
        # (1, v)/|(1, v)|^2, with 1/(1 + y) = 1 - y + y^2 within y^3.
        y = ops.saturated(dot(half, half), 0.5)
        inverse = ops.bounded(1.0 - y + y * y, 0.75, 1.0, "inverse of one and more")
        factor, scale = self._rescaled(x, traces, roots, restart)
        inverse = factor * inverse
        correction = [inverse, *(ops.bounded(v * inverse, -1.0, 1.0, "part") for v in half)]
        a = covariance.downdated(a, gains, far)
        after = self._turned(a, correction, factor, restart, p, half_scale)
        start = [ops.saturated(v, 1.0) for v in ops.sincos_ht(0.5 * p.start_heading)]
        first = zip("wxyz", (start[1], 0.0, 0.0, start[0]), q_new, strict=True)
        roll, pitch, heading = roll_pitch_heading_ht(matrix(q_new))
        states = {
            **{f"q{axis}": ops.where(restart, s, c) for axis, s, c in first},
            **{f"bias_{axis}": b for axis, b in zip("xyz", bias, strict=True)},
            **{name: after[i][j] for name, i, j in covariance.element_names(6)},
            **scale,
            "heading_pi": ops.where(restart, p.start_heading, loop["heading_pi"]),
            "drift": ops.where(restart, 0.0, loop["drift"]),
            "since": ops.where(restart, 0.0, loop["since"]),
        }
        flags = {0: moving, 1: ~loop["tracked"], 2: loop["beyond"], 3: full}
        rates = zip(self.outputs[len(Satcom.outputs) :], moves, strict=False)
        return states, {
            **{o.name: p.scale * nu for o, nu in rates},
            "roll": roll,
            "pitch": pitch,
            "heading": heading,
            **{f"q{axis}": c for axis, c in zip("wxyz", q_new, strict=True)},
            **{f"bias_{axis}": b for axis, b in zip("xyz", bias, strict=True)},
            **{f"rate_{axis}": w for axis, w in zip("xyz", rate, strict=True)},
            "heading_pi": loop["heading_pi"],
            "status": parts.status_word(flags),
        }

    @staticmethod
    def _heading_loop(x: Any, u: Any, p: Any, dt: Any, heading_rate: Any) -> dict[str, Any]:
        """One step of the PI loop [half turns]."""
        turn_rate = (1.0 / math.pi) * ops.saturated(heading_rate, 16.0) - x.drift
        predicted = ops.wrap_ht(x.heading_pi + dt * turn_rate)
        tracked = u.tracking > 0.5
        outside = ops.absolute(u.e_psi) > p.tracking_gate
        used = tracked & ~outside
        error = (1.0 / math.pi) * u.e_psi + ops.wrap_ht(predicted - u.beam)
        since = ops.saturated(x.since + dt, 1.0)
        weight = ops.where(used, p.cutoff * since, 0.0)
        pull = ops.saturated(2.0 * p.damping * ops.saturated(weight, 8.0), 1.0)
        drift = x.drift + (p.cutoff * ops.saturated(weight, 8.0)) * error
        return {
            "tracked": tracked,
            "beyond": tracked & outside,
            "used": used,
            "heading_pi": ops.wrap_ht(predicted - pull * error),
            "drift": ops.saturated(drift, DRIFT_LIMIT),
            "since": ops.where(used, 0.0, since),
        }

    @staticmethod
    def _predicted(
        p0: covariance.Symmetric,
        c_nb: Any,
        dt: Any,
        roots: tuple[Any, Any],
        full: Any,
        bias_full: Any,
    ) -> covariance.Symmetric:
        """Phi P Phi^T + Q; where its trace is at the limit P does not grow.

        Phi = [1, -G; 0, 1], Q = diag(white, walk), and with the blocks A, B, D of P::

            B' = B - G D        A' = A - B G^T - G B'^T
        """
        dt_p = ops.where(full, 0.0, dt)
        step = ops.saturated((0.5 / BIAS_UNIT) * dt_p, 2.0**-4)
        g = [
            [ops.bounded(step * c, -(2.0**-4), 2.0**-4, "half a step") for c in row] for row in c_nb
        ]
        white = ops.saturated(roots[0] * dt_p, STEP_LIMIT)
        walk = ops.saturated(roots[1], STEP_LIMIT)
        white_noise = ops.maximum(white * white, LEAST_NOISE)
        walk_noise = ops.where(bias_full, 0.0, ops.maximum(walk * walk * dt, LEAST_NOISE))
        rotation, drift = range(3), range(3, 6)
        after = [[part(p0[i][j] - dot(g[i], p0[j][3:])) for j in drift] for i in rotation]

        def element(i: int, j: int) -> Any:
            if i in rotation and j in drift:
                return after[i][j - 3]
            value = p0[i][j]
            if j in rotation:
                value = part(value - dot(p0[i][3:], g[j])) - dot(g[i], after[j])
            noise = white_noise if j in rotation else walk_noise
            return covariance.bounded_element(value + noise if i == j else value, i, j)

        return covariance.symmetric(6, element)

    @staticmethod
    def _rescaled(
        x: Any, traces: list[Any], roots: tuple[Any, Any], restart: Any
    ) -> tuple[Any, dict[str, Any]]:
        """(root of what P is multiplied by, 0 at a restart; ``finer`` and its inverse).

        ``finer`` doubles while P is small, unless a record of 0.25 s would then clamp a process
        noise; it halves where P is large.
        """
        trace = traces[0] + traces[1]
        # Each term is below SMALL: the trace, then the noises at twice the scale, FINEST.
        room = roots[0] * (0.5 * SMALL / STEP_LIMIT) + roots[1] * (2.0 * SMALL / STEP_LIMIT)
        grow = trace + room + (SMALL / FINEST) * x.finer < SMALL
        shrink = trace - trace * x.coarser > LARGE
        factor = ops.where(shrink, 0.5, ops.where(grow, 2.0, 1.0))
        inverse = factor * factor - 3.5 * factor + 3.5  # of 2, 1 and 1/2
        return ops.where(restart, 0.0, factor), {
            "finer": ops.where(restart, 1.0, factor * x.finer),
            "coarser": ops.where(restart, 1.0, inverse * x.coarser),
        }

    @staticmethod
    def _turned(
        a: covariance.Symmetric, c: list[Any], factor: Any, restart: Any, p: Any, half_scale: Any
    ) -> covariance.Symmetric:
        """P in the basis of the corrected quaternion, its norm taken off; P0 at a restart.

        ``c`` is multiplied by ``factor`` already.
        """
        wanted = (p.p0_sd * half_scale, (2.0 * BIAS_UNIT) * p.bias_p0_sd * half_scale)
        roots = [ops.saturated(root, P0_LIMIT) for root in wanted]

        def element(i: int, j: int, value: Any) -> Any:
            if j >= 3:
                value = (factor if i < 3 else factor * factor) * covariance.bounded_element(
                    value, i, j
                )
            if i == j:
                value = ops.where(restart, roots[i // 3] * roots[i // 3], value)
            return covariance.bounded_element(value, i, j)

        return covariance.partly_turned([row[1:] for row in right_matrix(c)[1:]], a, element)
