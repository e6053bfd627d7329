"""Attitude of a radar array that turns for eight hours: strapdown and 13 error states.

Wang Wenzhe et al., Modern Radar 38(9), 2016, with what its equations lost put back
(`docs/systems/array.md`): axes east, north, up; body x right, y the array's normal, z up,
C = Rz(heading) Rx(pitch) Ry(roll), heading counter-clockwise.

* At rest after a restart: `alignment`; then the attitude is known, and the filter begins.
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

from boresight import Estimator, ops
from boresight.model.algebra import strapdown as sd
from boresight.model.algebra.carried import BELOW
from boresight.model.algebra.covariance import covariance_of, element_names
from boresight.model.algebra.ellipsoid import Site, site
from boresight.model.algebra.quaternion import Vector, dot, matrix, of_angles, turn
from boresight.model.algebra.quaternion_filter import status_word
from boresight.model.algebra.scalar_update import MOVE_LIMIT, Measured, kept, lowered, updated
from boresight.model.algebra.strapdown import AXES, NAVIGATION, STEP_TURN
from boresight.model.errors import require
from boresight.systems.array import alignment
from boresight.systems.array import error_filter as errors
from boresight.systems.array.error_filter import KINDS, UNITS

READINGS = ("heading", "literal")
CUT_NOISE = 0.35  #: with which a heading whose variance is at its limit is cut, scaled.
MOST_DRIFT = 2.0  #: largest velocity that is measured as zero, scaled: 1/8 m/s.
REFUSED = 0.0145  #: what the heading's variance grows by where an index is beyond the gate.


class ArrayAttitude(Estimator):
    """Attitude of an array that turns, from gyro and accelerometer increments and an index.

    * ``latitude`` [deg], up to 89, and ``height`` above the ellipsoid [m], of the site;
    * ``attitude``: pitch, roll, heading before the first sample [deg]; with ``align`` any will do;
    * ``reading``: measurement at an index, "heading" or "literal"; ``rate``: records a second;
    * ``align``: seconds at rest to find the attitude in, 30 to 300; 0: ``attitude`` is right;
    * ``aided=False``: strapdown alone, from ``attitude``.

    `InputError`: one of these is none of that.
    """

    name = "array_attitude"
    summary = "array that turns for hours: strapdown, 13-state filter, zero velocity, azimuth index"
    inputs = errors.INPUTS
    status_bits = errors.STATUS_BITS
    urgent = 3

    def __init__(
        self,
        latitude: float = 31.9521,
        height: float = 45.0,
        attitude: Sequence[float] = (1.0, 2.0, 90.0),
        reading: str = "heading",
        rate: float = 100.0,
        align: float = 300.0,
        *,
        aided: bool = True,
    ) -> None:
        _check("latitude", latitude, -89.0, 89.0)
        _check("height", height, -500.0, 10e3)
        _check("rate", rate, 50.0, 1000.0)
        names = ("pitch", "roll", "heading")
        require(len(attitude) == 3, "array_attitude, attitude", ", ".join(names), attitude)
        for name, value in zip(names, attitude, strict=True):
            _check(name, value, -360.0, 360.0)
        known = align == 0.0 or 30.0 <= align <= 300.0
        require(known, "array_attitude, align", "30 to 300, or 0", align)
        # A 24th of the time is for levelling, where the tilt is steep.
        self.align = round(23.0 / 24.0 * align * rate) - 4 if aided and align else 0
        readings = " or ".join(READINGS)
        require(reading in READINGS, "array_attitude, reading", readings, reading, "choose one")
        self.rate, self.dt = rate, 1.0 / rate
        self.literal, self.aided = reading == "literal", aided
        start = [min(c, BELOW) for c in of_angles(*attitude)]
        self.params = sd.params(latitude / 180.0, height, start)
        place = site(latitude / 180.0, height, self.dt)
        self.states = sd.states(sd.ahead(start, place))
        self.outputs = sd.OUTPUTS
        if aided:
            self.params += errors.filter_params(self.align)
            first = errors.first_variances(SimpleNamespace(**self.param_values()))
            self.states += errors.filter_states(
                start, [first[k] for k in KINDS], rate, self.align, self.literal
            )
            self.outputs += errors.OUTPUTS
        if self.align:
            self.states += alignment.states(self.align, self.dt)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        restart = u.phase < -0.5
        sample = sd.sampled(x, u, p)
        seen = sd.angles(sample.q)
        place = site(p.latitude, p.height, self.dt)
        c = matrix([getattr(x, f"q{k}") for k in "wxyz"], unit=False)
        start = [getattr(p, f"start_q{k}") for k in "wxyz"]
        base = [ops.where(restart, s, q) for s, q in zip(start, sample.q, strict=True)]
        eps = [getattr(p, f"gyro_bias_{a}") for a in AXES]
        nabla = [getattr(p, f"force_bias_{a}") for a in AXES]
        if self.aided:
            eps = [b + getattr(x, f"eps_{a}") for a, b in zip(AXES, eps, strict=True)]
            nabla = [b + getattr(x, f"nabla_{a}") for a, b in zip(AXES, nabla, strict=True)]
        force = [f - self.dt * n for f, n in zip(sample.force, nabla, strict=True)]
        v, axes = sd.velocity(x, c, force, place)
        hold, begin, rest = restart, restart, None
        if self.align:
            rest = alignment.aligned(
                x, u.phase, sample.q, turn(c, force), place.earth, self.align, self.dt
            )
            hold, begin = restart | rest.running, restart | rest.found
            base = [ops.where(rest.found, f, q) for f, q in zip(rest.q, base, strict=True)]
            inertial = rest.running & ~rest.found
            axes = [ops.where(inertial, 0.0, a) for a in axes]
        drift = turn(c, [self.dt * e for e in eps])
        axes = [a + e for a, e in zip(axes, drift, strict=True)]
        correction: Vector = (0.0, 0.0, 0.0)
        if self.aided:
            up = ops.saturated(dot(c[2], sample.turn), 2.0 * STEP_TURN)
            axes[2] = axes[2] + x.scale_up * up
            now = _Now(hold, sample, seen, place, v, up)
            states, more, moves, propagated = self._filtered(x, u, p, now)
            v = [a - m for a, m in zip(v, moves[:3], strict=True)]
            correction = [moves[k] for k in errors.PHI]
        if rest is not None:
            # To the end of the sample: the Earth has turned since half way.
            correction = [
                m - ops.where(rest.found, w, 0.0)
                for m, w in zip(correction, rest.turned, strict=True)
            ]
        v = [ops.saturated(ops.where(hold, 0.0, a), sd.VELOCITY) for a in v]
        velocities = {f"v{a}": s for a, s in zip(NAVIGATION, v, strict=True)}
        after = velocities | sample.last
        after |= sd.next_attitude(x, sample, base, [-a for a in axes], correction, begin)
        outputs = (
            seen.outputs | {f"q{a}": q for a, q in zip("wxyz", sample.q, strict=True)} | velocities
        )
        if not self.aided:
            return after, outputs
        after |= states
        old = {f"from_q{a}": getattr(x, f"from_q{a}") for a in "wxyz"}
        if rest is not None:
            sums = {f"from_q{a}": s for a, s in zip(AXES, rest.up, strict=True)}
            old |= {n: ops.where(rest.running, s, old[n]) for n, s in sums.items()}
            count = ops.where(rest.running, rest.count, after["count"])
            after |= rest.states | {"count": ops.where(restart, -1.0 - self.align, count)}
        for a in "wxyz":
            moved = propagated | begin
            after[f"from_q{a}"] = ops.where(moved, after[f"q{a}"], old[f"from_q{a}"])
        return after, outputs | more

    def _filtered(
        self, x: Any, u: Any, p: Any, now: _Now
    ) -> tuple[dict[str, Any], dict[str, Any], list[Any], Any]:
        """States and outputs of the filter; moves of the 13 states; whether P was propagated."""
        hold, working, arrived = now.hold, u.phase > 1.5, u.index > 0.5
        erecting = (u.phase > 0.5) & ~working
        turned = ops.saturated(x.turned + (1.0 / math.pi) * now.up, 4.0)
        turned = ops.bounded(turned, -4.0, 4.0 * BELOW, "saturated")
        angle = ops.absolute(turned)
        # Four samples after an index are the velocities' and the cut's; those after a second wait.
        accepted = (
            working & ~hold & arrived & ((x.count > 3.5) | (x.late < 0.5)) & (angle >= p.index_turn)
        )
        due = (x.count > self.rate - 1.5) | accepted
        count = x.count + 1.0
        samples = ops.where(due, count, 0.0)
        earth = (samples * now.place.earth[0], samples * now.place.earth[1])
        ends = ([getattr(x, f"from_q{k}") for k in "wxyz"], now.sample.q)
        prior = errors.propagated(covariance_of(x, 13), *ends, self.dt * samples, earth)
        running, keep_force = ~hold, ~(hold | (erecting & due))
        prior = kept(prior, lambda i, j: keep_force if {i, j} & {*errors.FORCE} else running)

        full = x.p66 >= errors.LIMITS["heading"]
        off = errors.offset(u, now.sample, now.seen)
        at_index = (
            errors.change(x, p, off, turned) if self.literal else errors.fix(p, now.seen, off)
        )
        measured = _measured(p, now, x.count, at_index, accepted, full)
        gate = ops.where(accepted & ~full, p.index_gate, 2.0 * MOVE_LIMIT)
        update = updated(prior, measured, gate)

        growth = errors.grown(x, p, self.dt * samples, due, erecting)
        heading = errors.PHI[2]
        growth[heading] = ops.where(update.beyond & ~full, REFUSED, growth[heading])
        first = errors.first_variances(p)
        growth = [ops.where(hold, first[k], m) for k, m in zip(KINDS, growth, strict=True)]
        p_after = lowered(prior, update, growth)
        moves = errors.moves(update)
        learnt = {
            name: ops.saturated(ops.where(hold, 0.0, getattr(x, name) + moves[k]), limit)
            for k, (name, limit) in errors.LEARNT.items()
        }
        used = accepted & ~update.beyond
        states = {
            **learnt,
            **{name: p_after[i][j] for name, i, j in element_names(13)},
            "count": ops.where(hold | due, 0.0, ops.minimum(count, self.rate)),
            "late": ops.where(due, ops.where(accepted, 1.0, 0.0), x.late),
            "turned": ops.where(hold, 4.0 * BELOW, ops.where(used, 0.0, turned)),
        }
        if self.literal:
            before = ops.where(used, off, x.last_off)
            states["last_off"] = errors.corrected(before, now.seen, update)
        flags = {
            0: u.phase < 0.5,
            1: erecting,
            2: arrived & ~working,
            3: (arrived & working & ~accepted) | update.beyond,
            4: sd.beyond(u),
            5: full,
            6: used,
            7: angle >= 3.0,
            8: hold,
        }
        return states, learnt | {"status": status_word(flags)}, moves, due


@dataclass(frozen=True)
class _Now:
    """Results of a sample's strapdown; ``up``: the turn about up [rad].

    ``hold``: a restart, or the attitude is not known yet: the filter waits in its first state.
    """

    hold: Any
    sample: sd.Sample
    seen: sd.Angles
    place: Site
    v: list[Any]
    up: Any


def _measured(p: Any, now: _Now, count: Any, at_index: Measured, used: Any, full: Any) -> Measured:
    """Measurement of a sample: an index, a velocity in its turn, or none where it cuts.

    ``count``: samples since the latest propagation, before this one.
    """
    early = [0.0, *(ops.where(count < k + 0.5, 1.0, 0.0) for k in range(3))]
    turns = [b - a for a, b in zip(early, early[1:], strict=False)]
    row = {k: ops.where(used, 0.0, turn) for k, turn in enumerate(turns)}
    zero = dot(list(row.values()), [(1.0 / UNITS["velocity"]) * v for v in now.v])
    cut = full & (count > 2.5) & ~used
    row |= {k: ops.where(cut, h, 0.0) for k, h in errors.heading_row(now.seen).items()}
    row |= {k: ops.where(used, h, row.get(k, 0.0)) for k, h in at_index.row.items()}
    zupt = (1.0 / UNITS["velocity"]) * p.zupt_sd
    return Measured(
        row,
        ops.saturated(zero, MOST_DRIFT) + ops.where(used, at_index.innovation, 0.0),
        ops.where(used, at_index.variance, ops.where(cut, CUT_NOISE, zupt * zupt)),
    )


def _check(name: str, value: float, low: float, high: float) -> None:
    require(low <= value <= high, f"array_attitude, {name}", f"{low:g} to {high:g}", value)
