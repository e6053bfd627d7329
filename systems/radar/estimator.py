"""Biases of two radars from the difference of their tracks, and tracks free of them.

Cui, Zhang, Wang, J. Chin. Inertial Tech. 22(5), 2014: the centre sees positions X_1, X_2 of one
target in earth-fixed axes, not what the radars measured. Radar i stands at O_i, its axes east,
north, up are the columns of T_i, and its range, elevation, azimuth (rho, e, n) have the constant
biases b_i and white noise v_i::

    z = X_1 - X_2 = J_1 (b_1 + v_1) - J_2 (b_2 + v_2)        J_i = T_i dl/d(rho, e, n)

* **Basis.** J_i = T_i U_i diag(1, rho, rho cos e) with U_i of unit vectors along the beam, up and
  to the right of it. Rows are taken along those of radar 1, biases in units of the noise, so that
  with D = diag(range_sd, rho elevation_sd, rho cos(e) azimuth_sd)::

      H = [D_1, -M D_2]    R = H H^T    M = U_1^T T_1^T T_2 U_2

* **Update.** H is whitened and P = S S^T updated as `model.algebra.square_root` says. State and S
  are held over the first standard deviations p0, the state in two words. While P is too wide for
  the words of S^T a, rows have less weight.
* **Where H is taken.** At the point where a quadratic fading-memory filter of each radar's
  positions expects the target, less the biases so far: H knows nothing of this sample's noise. The
  memory m = 1 - theta begins at one and becomes m - m^2/3, that of a track as long as the record,
  down to ``forgetting`` (Morrison, Introduction to Sequential Smoothing and Prediction, 1969)::

      p += (1 - theta^3) r    v += 3/2 (1 - theta)^2 (1 + theta) r/dt    a += 2 (1 - theta)^3 r/dt^2
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from boresight import Estimator, Input, Output, Param, State, ops
from boresight.model.algebra.carried import BELOW, carried
from boresight.model.algebra.quaternion import Matrix, Vector, conjugate_turn, dot, turn
from boresight.model.algebra.quaternion_filter import status_word, sum_of
from boresight.model.algebra.square_root import Potter, potter, whitened
from boresight.model.arrays import FloatArray
from boresight.model.errors import require

BIASES = ("range_1", "elevation_1", "azimuth_1", "range_2", "elevation_2", "azimuth_2")
WIDEST = 1024.0  #: largest first standard deviation of a bias, over the noise.
ECEF = 2.0**23  #: m, full scale of a position: words of 4 mm.
FASTEST = 32.0  #: Hz, largest rate of records.
REACH = 2.0**20  #: m, full scale of a position in a radar's axes.
_DEG = 0.017453292519943295
#: Noise of a radar: default, least, most, unit; biases at first, over that noise.
_NOISE = (
    ("range", 10.0, 1.0, 1000.0, "m"),
    ("elevation", 0.07 * _DEG, 1e-5, 0.1, "rad"),
    ("azimuth", 0.15 * _DEG, 1e-5, 0.1, "rad"),
)
_FIRST = {"range": 100.0, "elevation": 1.0 / 0.07, "azimuth": 1.0 / 0.15}

Site = Sequence[float]  #: longitude east, latitude north [deg], height [m].

EQUATOR = 6378137.0  #: m, WGS 84.
E2 = 6.69437999014e-3  #: its eccentricity squared.
SPREAD = 2.0**11  #: m, largest noise across the beam.
APART = 2.0**17  #: m, largest difference of the tracks.
SURPRISE = 2.0**15  #: m, largest component of the innovation.
KNOWN = 2.0**-6  #: rad, biases up to which H is taken without them, and beyond which it is linear.
MOST = (2.0**14, 1.0, 1.0) * 2  #: m, rad: largest biases that are estimated.
LIMIT = 8.0  #: largest bias over its first standard deviation.
IMPLAUSIBLE = 36.0  #: squared length of the biases over their first standard deviations.
YOUNG = 0.35  #: memory above which a track says too little of where the target is: six records.
ZENITH = 2.0**-5  #: cosine of the elevation below which there is no azimuth.
LEAST = 2.0**-14  #: weight of a row, at least.


def site(longitude: float, latitude: float, height: float) -> tuple[list[float], list[list[float]]]:
    """Position [m] in earth-fixed axes and the axes east, north, up there, as rows."""
    sin_l, cos_l = ops.sincos_ht(longitude / 180.0)
    sin_p, cos_p = ops.sincos_ht(latitude / 180.0)
    normal = EQUATOR * ops.rsqrt(1.0 - E2 * sin_p * sin_p)
    out = normal + height
    place = [out * cos_p * cos_l, out * cos_p * sin_l, (normal * (1.0 - E2) + height) * sin_p]
    east = [-sin_l, cos_l, 0.0]
    north = [-sin_p * cos_l, -sin_p * sin_l, cos_p]
    return place, [east, north, [cos_p * cos_l, cos_p * sin_l, sin_p]]


class Registration(Estimator):
    """Biases of two radars from their tracks of one target, and the tracks without them.

    Sites are longitude, latitude, height [deg, deg, m], WGS 84. `InputError`: a latitude beyond
    89 deg, a longitude beyond 180 deg, a height that no radar stands on, sites closer than a metre.
    """

    name = "registration"
    summary = "biases of two radars from the difference of their tracks; tracks without them"
    inputs = (
        Input("dt", -1.0, 1.0, "s", clamp=True, meaning="time step; below 0: begin anew"),
        *(
            Input(f"{a}{i}", -ECEF, ECEF, "m", missing="hold", meaning=f"ECEF {a} of radar {i}")
            for i in "12"
            for a in "xyz"
        ),
        *(
            Input(f"seen_{i}", 0.0, 1.0, valid_of=(f"x{i}", f"y{i}", f"z{i}"), meaning="a sample")
            for i in "12"
        ),
    )
    params = (
        *(
            Param(f"{name}_sd_{i}", value, low, high, unit, f"noise of the {name} of radar {i}")
            for i in "12"
            for name, value, low, high, unit in _NOISE
        ),
        *(
            Param(f"p0_{b}", _FIRST[b[:-2]], 0.0, WIDEST, "", f"bias {b} at first, over its noise")
            for b in BIASES
        ),
        Param("rate", 10.0, 0.1, FASTEST, "Hz", "of the records, for the gains of the tracks"),
        Param("forgetting", 0.1, 1e-3, 0.5, "", "of the tracks: 1 - theta of the fading memory"),
        Param("correct_from", 80.0, 0.0, 1000.0, "s", "after a restart: tracks are corrected"),
        Param("gate", 1e5, 1.0, 1.3e5, "m", "component of the difference beyond it is not used"),
        Param("gap", 2.0, 0.1, 100.0, "s", "after so long without a pair the tracks begin anew"),
    )
    states = (
        *(State(f"bias_{k}", -8.0, 8.0 * BELOW) for k in range(6)),
        *(State(f"rest_{k}", -(2.0**-12), 2.0**-12 * BELOW) for k in range(6)),
        *(
            State(f"s{i}{j}", -1.0, BELOW, "", BELOW if i == j else 0.0)
            for i in range(6)
            for j in range(6)
        ),
        # Before the first track: anywhere but at the radar itself.
        *(State(f"pos_{i}{a}", -REACH, REACH * BELOW, "m", 1e5) for i in "12" for a in "enu"),
        *(State(f"vel_{i}{a}", -(2.0**16), 2.0**16 * BELOW, "m/s") for i in "12" for a in "enu"),
        *(State(f"acc_{i}{a}", -(2.0**18), 2.0**18 * BELOW, "m/s^2") for i in "12" for a in "enu"),
        State("memory", 0.0, 1.0, "", 1.0),
        State("weight", 0.0, 1.0, "", 1.0),
        State("unpaired", 0.0, 128.0, "s"),
        State("time", 0.0, 1024.0, "s"),
    )
    outputs = (
        *(
            Output(f"{b}_bias", "m" if b[0] == "r" else "rad", 0.05 if b[0] == "r" else 1e-6)
            for b in BIASES
        ),
        *(Output(f"{a}{i}_corrected", "m", 0.05) for i in "12" for a in "xyz"),
        Output("nis", "", 0.05, "normalised innovation squared, three degrees of freedom"),
        Output("status", "bits"),
    )
    restarts = True
    status_bits = {
        0: "a radar has no sample: no measurement",
        1: "no track of both radars yet, or none any more: no measurement",
        2: "target below a radar's horizon or near its zenith: no measurement",
        3: "the tracks are further apart than the gate: no measurement",
        4: "the biases are beyond six first standard deviations",
        5: "the outputs are corrected",
    }
    nis_freedom = 3

    def __init__(
        self, site_1: Site = (115.74, 29.43, 5.0), site_2: Site = (114.11, 30.71, 5.0)
    ) -> None:
        self.sites = [_checked(k, s) for k, s in ((1, site_1), (2, site_2))]
        self.places, self.axes = zip(*(site(*s) for s in self.sites), strict=True)
        distance = math.sqrt(
            math.fsum((a - b) * (a - b) for a, b in zip(*self.places, strict=True))
        )
        apart = "radars a metre apart or more"
        require(distance >= 1.0, "registration, sites", apart, f"{distance:.3g} m")
        #: T_1^T T_2.
        self.between = [[dot(a, b) for b in self.axes[1]] for a in self.axes[0]]

    def error_covariance(
        self, states: Mapping[str, FloatArray], params: Mapping[str, float]
    ) -> tuple[tuple[str, ...], FloatArray]:
        """See `Estimator`: of the six biases, P = S S^T in their units."""
        root = np.array([[states[f"s{i}{j}"] for j in range(6)] for i in range(6)])
        sd = [params[f"{b[:-2]}_sd_{b[-1]}"] * params[f"p0_{b}"] for b in BIASES]
        root = root.transpose(2, 0, 1) * np.array(sd)[:, None]
        p = (root[:, :, None] * root[:, None]).sum(axis=3)
        return tuple(f"{b}_bias" for b in BIASES), p

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        restart = u.dt < 0.0
        dt = ops.where(restart, 0.0, u.dt)
        samples = [[getattr(u, f"{a}{i}") for a in "xyz"] for i in "12"]
        both = u.seen_1 + u.seen_2 > 1.5

        fresh = restart | (x.memory >= 1.0) | (x.unpaired > p.gap)
        tracks, expected = self._tracks(x, u, p, dt, samples, fresh & both)
        memory = ops.maximum(x.memory - (1.0 / 3.0) * (x.memory * x.memory), p.forgetting)
        memory = ops.where(fresh, ops.where(both, 2.0 / 3.0, 1.0), memory)
        unpaired = ops.saturated(ops.where(both, 0.0, x.unpaired + dt), 128.0)

        # Biases so far; beams at the targets without them; the noise along these.
        sd = [[getattr(p, f"{n}_sd_{i}") for n in ("range", "elevation", "azimuth")] for i in "12"]
        first = [getattr(p, f"p0_{b}") for b in BIASES]
        units = [
            ops.saturated(f * s, high)
            for f, s, high in zip(first, [*sd[0], *sd[1]], MOST, strict=True)
        ]
        state = [getattr(x, f"bias_{k}") for k in range(6)]
        before = [ops.saturated(b * s, high) for b, s, high in zip(state, units, MOST, strict=True)]
        beams = [_Beam(at, before[3 * i : 3 * i + 3]) for i, at in enumerate(expected)]

        # Innovation and H along the beam of radar 1; whitened, and in units of p0.
        separation = [ops.saturated(a - b, APART) for a, b in zip(*samples, strict=True)]
        within_gate = sum_of(ops.absolute(c) for c in separation) < p.gate
        h, z = self._measured(
            beams, sd, [ops.saturated(c, APART) for c in turn(self.axes[0], separation)]
        )
        rows, white = whitened(h, [c * x.weight for c in z], 2.0 * SPREAD, SURPRISE)
        scale = [ops.bounded(f * x.weight, 0.0, WIDEST, "of p0") for f in first]
        rows = [
            [ops.bounded(c * s, -WIDEST, WIDEST, "noise") for c, s in zip(r, scale, strict=True)]
            for r in rows
        ]

        # Update.
        root = [[getattr(x, f"s{i}{j}") for j in range(6)] for i in range(6)]
        visible = beams[0].good & beams[1].good
        young = fresh | (x.memory > YOUNG)
        live = both & ~young & visible & within_gate
        update = potter(root, rows, white, live, restart)
        weight = ops.where(update.wide, 2.0**-5 * x.weight + LEAST, 4.0 * x.weight)
        after = {
            **self._updated(x, state, update, restart),
            **tracks,
            "memory": memory,
            "weight": ops.saturated(ops.where(live, weight, x.weight), 1.0),
            "unpaired": unpaired,
            "time": ops.saturated(ops.where(restart, 0.0, x.time + dt), 1024.0),
        }

        # Outputs.
        biases = [
            ops.saturated(after[f"bias_{k}"] * s, high)
            for k, (s, high) in enumerate(zip(units, MOST, strict=True))
        ]
        correcting = x.time + dt >= p.correct_from
        flags = {
            0: ~both,
            1: young,
            2: ~visible,
            3: ~within_gate,
            4: dot(state, state) > IMPLAUSIBLE,
            5: correcting,
        }
        return after, {
            **{f"{b}_bias": v for b, v in zip(BIASES, biases, strict=True)},
            **self._corrected(samples, beams, correcting),
            "nis": ops.saturated(ops.where(live, dot(update.white, update.white), 0.0), 2.0**10),
            "status": status_word(flags),
        }

    def _tracks(
        self, x: Any, u: Any, p: Any, dt: Any, samples: Matrix, begin: Any
    ) -> tuple[dict[str, Any], list[list[Any]]]:
        """Tracks (states by name) and expected positions of both radars, in their own axes."""
        m, rate = x.memory, p.rate
        mm = m * m
        cube = ops.bounded(mm * m, 0.0, 1.0, "cube")
        gain_p = ops.bounded(3.0 * m - 3.0 * mm + cube, 0.0, 1.0, "1 - theta^3")
        slope = ops.bounded(3.0 * mm - 1.5 * cube, 0.0, 1.5, "3/2 (1 - theta)^2 (1 + theta)")
        gain_v = ops.bounded(slope * rate, 0.0, 1.5 * FASTEST, "of the velocity")
        gain_a = ops.bounded(
            (2.0 * cube) * (rate * rate), 0.0, 2.0 * FASTEST * FASTEST, "of the acceleration"
        )
        half = 0.5 * (dt * dt)
        after: dict[str, Any] = {}
        expected = []
        for i, detected in enumerate((u.seen_1 > 0.5, u.seen_2 > 0.5)):
            origin = turn(self.axes[i], self.places[i])
            at = []
            for k, a in enumerate("enu"):
                name = f"{i + 1}{a}"
                v, acc = getattr(x, f"vel_{name}"), getattr(x, f"acc_{name}")
                local = ops.saturated(dot(self.axes[i][k], samples[i]) - origin[k], REACH)
                predicted = ops.saturated(getattr(x, f"pos_{name}") + dt * v + half * acc, REACH)
                r = ops.saturated(ops.where(detected, local - predicted, 0.0), APART)
                after[f"pos_{name}"] = ops.saturated(
                    ops.where(begin, local, predicted + gain_p * r), REACH
                )
                after[f"vel_{name}"] = ops.saturated(
                    ops.where(begin, 0.0, v + dt * acc + gain_v * r), 2.0**16
                )
                after[f"acc_{name}"] = ops.saturated(
                    ops.where(begin, 0.0, acc + gain_a * r), 2.0**18
                )
                at.append(predicted)
            expected.append(at)
        return after, expected

    def _measured(
        self, beams: list[_Beam], sd: Matrix, local: Vector
    ) -> tuple[list[Any], list[Any]]:
        """H in units of the noise and the innovation; ``local``: z in axes of radar 1."""
        noise = [
            [s[0], *(ops.saturated(arm * a, SPREAD) for arm, a in zip(b.arms, s[1:], strict=True))]
            for b, s in zip(beams, sd, strict=True)
        ]
        unit_2 = [
            [ops.bounded(c, -1.0, 1.0, "unit vector") for c in turn(self.between, b)]
            for b in beams[1].unit
        ]
        h, z = [], []
        for k, along in enumerate(beams[0].unit):
            m = [ops.bounded(dot(along, b), -1.0, 1.0, "cosine") for b in unit_2]
            row_1 = [noise[0][k] if j == k else 0.0 for j in range(3)]
            row_2 = [
                ops.bounded(-(c * d), -SPREAD, SPREAD, "noise")
                for c, d in zip(m, noise[1], strict=True)
            ]
            h.append([*row_1, *row_2])
            z.append(
                ops.saturated(
                    dot(along, local) - beams[0].moved[k] + dot(m, beams[1].moved), SURPRISE
                )
            )
        return h, z

    @staticmethod
    def _updated(x: Any, state: Vector, update: Potter, restart: Any) -> dict[str, Any]:
        after = {}
        for k in range(6):
            after[f"bias_{k}"], after[f"rest_{k}"] = carried(
                state[k], getattr(x, f"rest_{k}"), update.moves[k], LIMIT, restart
            )
            after |= {f"s{k}{j}": update.root[k][j] for j in range(6)}
        return after

    def _corrected(self, samples: Matrix, beams: list[_Beam], correcting: Any) -> dict[str, Any]:
        out = {}
        for i, (axes, beam) in enumerate(zip(self.axes, beams, strict=True)):
            local = [ops.saturated(c, APART) for c in conjugate_turn(beam.unit, beam.moved)]
            for a, c, o in zip("xyz", samples[i], conjugate_turn(axes, local), strict=True):
                out[f"{a}{i + 1}_corrected"] = ops.saturated(ops.where(correcting, c - o, c), ECEF)
        return out


class _Beam:
    """Where a radar's target is without the bias: unit vectors along, up and to the right of it.

    With p as expected, d its point less the biases c (rho, e, n), in axes of d::

        l(p) - l(d) = (c_rho - rho (1 - cos c_e) - h cos(e_d) (1 - cos c_n),
                       rho sin c_e + h sin(e_d) (1 - cos c_n), h sin c_n)      h = rho cos e, of p

    ``arms``: rho, rho cos e of d [m]; ``moved``: shift by the bias, linear beyond `KNOWN` [m];
    ``good``: above the horizon and away from the zenith.
    """

    def __init__(self, at: Vector, bias: Vector) -> None:
        east, north, up = at
        level_sq = ops.bounded(east * east + north * north, 0.0, 2.0 * REACH * REACH, "square")
        far = "the target is beyond reach"
        high = 2.0 * REACH * REACH
        square = ops.bounded(level_sq + up * up, 0.0, high, "square", unless=far)
        inverse_level, inverse_distance = ops.rsqrt(level_sq), ops.rsqrt(square)
        level = ops.bounded(level_sq * inverse_level, 0.0, 1.5 * REACH, "distance")
        distance = ops.bounded(square * inverse_distance, 0.0, 1.5 * REACH, "distance", unless=far)
        sin_n, cos_n = (ops.saturated(c * inverse_level, 1.0) for c in (east, north))
        sin_e = ops.saturated(up * inverse_distance, 1.0)
        cos_e = ops.bounded(level * inverse_distance, 0.0, 1.0, "cosine of the elevation")
        (sin_e, cos_e), climb, climb_bent, climb_rest = _subtract_angle(sin_e, cos_e, bias[1])
        (sin_n, cos_n), swing, swing_bent, swing_rest = _subtract_angle(sin_n, cos_n, bias[2])
        flat = [ops.bounded(c * cos_e, -1.0, 1.0, "unit vector") for c in (sin_n, cos_n)]
        rise = [ops.bounded(-(c * sin_e), -1.0, 1.0, "unit vector") for c in (sin_n, cos_n)]
        self.unit: Matrix = [[*flat, sin_e], [*rise, cos_e], [cos_n, -sin_n, 0.0]]
        far = ops.saturated(distance - bias[0], 2.0 * REACH)
        self.arms = [far, ops.saturated(far * cos_e, 2.0 * REACH)]
        bent = ops.saturated(level * swing_bent, APART)
        self.moved = [
            ops.saturated(bias[0] - distance * climb_bent - cos_e * bent, APART),
            ops.saturated(distance * climb + sin_e * bent + far * climb_rest, APART),
            ops.saturated(level * swing + self.arms[1] * swing_rest, APART),
        ]
        self.good = sin_e * cos_e - ZENITH * sin_e > 0.0


def _subtract_angle(sine: Any, cosine: Any, angle: Any) -> tuple[list[Any], Any, Any, Any]:
    """Sine and cosine of an angle less c; c, for its sine; 1 - cos c; what ``angle`` has beyond."""
    c = ops.saturated(angle, KNOWN)
    bent = ops.bounded(0.5 * (c * c), 0.0, 0.5 * KNOWN * KNOWN, "square of a small angle")
    turned = [sine - sine * bent - cosine * c, cosine - cosine * bent + sine * c]
    return [ops.bounded(v, -1.0, 1.0, "of a unit vector") for v in turned], c, bent, angle - c


def _checked(number: int, coordinates: Site) -> tuple[float, ...]:
    """A site whose place on the earth is plausible."""
    where, ranges = f"registration, site_{number}", ((-180.0, 180.0), (-89.0, 89.0), (-500.0, 20e3))
    try:
        place = tuple(float(v) for v in coordinates)
    except (TypeError, ValueError):
        place = ()
    require(len(place) == 3, where, "longitude, latitude [deg], height [m]", coordinates)
    names = ("longitude", "latitude", "height")
    for name, value, (low, high) in zip(names, place, ranges, strict=True):
        require(low <= value <= high, f"{where}, {name}", f"{low:g} to {high:g}", value)
    return place
