"""Sensorless motor drive: currents in, voltage out, 20,000 times a second.

`Observer` is the filter: currents, speed and angle of a synchronous machine from its currents, four
states. `Pmsm` is a core that drives the machine with them: speed and current controllers beside the
filter. The voltage is computed from the predicted state and leaves before the correction begins.
Angles are electrical, in half turns; `theta` is the angle in the middle of the period that begins,
where its induced voltage is the period's mean, and where the next voltage is needed.
"""

from __future__ import annotations

from typing import Any

from boresight import Input, Output, Param, State, ops
from boresight.kalman import Kalman, Measurement
from boresight.kalman import State as Estimated

DT = 50e-6  # s
PI = 3.141592653589793
R, L, PSI = 0.5, 1e-3, 0.05  # ohm, H, Wb
DECAY = ops.exp(-DT * R / L)  #: share of a current that a period leaves.
PER_VOLT = (1.0 - DECAY) / R  #: current of one volt at the end of a period [A/V].
CURRENT, VOLTAGE = 16.0, 64.0  #: largest current wanted [A], largest voltage [V].


class Observer(Kalman):
    """Currents in stator axes, electrical speed and angle of a synchronous machine."""

    inputs: tuple[Input, ...] = (
        Input("v_a", -100.0, 100.0, "V", meaning="voltage of the period before, stator axis a"),
        Input("v_b", -100.0, 100.0, "V", meaning="voltage of the period before, stator axis b"),
        Input("i_a", -40.0, 40.0, "A", meaning="current at its end, stator axis a"),
        Input("i_b", -40.0, 40.0, "A", meaning="current at its end, stator axis b"),
    )
    params: tuple[Param, ...] = (
        Param("r_i", 0.01, 1e-3, 1.0, "A^2", "variance of a current"),
        Param("q_i", 4e-3, 1e-4, 1.0, "A^2", "noise of a current in a step: dead time, ripple"),
        Param("q_w", 2.0, 1e-2, 1e2, "(rad/s)^2", "noise of the speed in a step: torque"),
        Param("q_t", 1e-8, 1e-10, 1e-4, "ht^2", "noise of the angle in a step"),
    )
    states = (
        Estimated("ia", -40.0, 40.0, "A", sd=1.0, sd_max=2.0),
        Estimated("ib", -40.0, 40.0, "A", sd=1.0, sd_max=2.0),
        Estimated("omega", -2048.0, 2048.0 - 2.0**-20, "rad/s", sd=100.0, sd_max=512.0),
        Estimated("theta", -1.0, 1.0, "ht", sd=0.3, sd_max=1.0),
    )
    outputs: tuple[Output, ...] = (
        Output("theta", "ht", tolerance=2e-5),
        Output("omega", "rad/s", tolerance=0.02),
        Output("ia", "A", tolerance=1e-4),
        Output("ib", "A", tolerance=1e-4),
    )
    prior = True
    urgent = 2

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """One period: the voltage is that of the period before the measured currents."""
        sine, cosine = ops.sincos_ht(x.theta)
        emf = (PER_VOLT * PSI) * x.omega
        return {
            "ia": DECAY * x.ia + emf * sine + PER_VOLT * u.v_a,
            "ib": DECAY * x.ib - emf * cosine + PER_VOLT * u.v_b,
            "theta": ops.wrap_ht(x.theta + (DT / PI) * x.omega),
        }

    def noise(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Variances that a period adds."""
        return {"ia": p.q_i, "ib": p.q_i, "omega": p.q_w, "theta": p.q_t}

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        """Two currents."""
        return [Measurement(u.i_a, x.ia, p.r_i), Measurement(u.i_b, x.ib, p.r_i)]


class Pmsm(Observer):
    """Sensorless drive of a synchronous machine: Kalman filter, speed and current controllers."""

    inputs = (
        *Observer.inputs,
        Input("target", -1500.0, 1500.0, "rad/s", meaning="electrical speed that is wanted"),
        Input("forced", 0.0, 1.0, meaning="1: start, a current that turns ever faster"),
    )
    params = (
        *Observer.params,
        Param("slew", 0.3, 0.0, 4.0, "rad/s", "most that the wanted speed changes in a step"),
        Param("kp_w", 0.03, 0.0, 1.0, "A s/rad", "speed controller"),
        Param("ki_w", 1e-4, 0.0, 0.01, "A s/rad", "the same, integral, a step"),
        Param("kp_i", 3.0, 0.0, 16.0, "V/A", "current controllers"),
        Param("ki_i", 0.1, 0.0, 1.0, "V/A", "the same, integral, a step"),
        Param("start_current", 6.0, 0.0, 15.0, "A", "of the forced start"),
        Param("start_slew", 0.06, 0.0, 1.0, "rad/s", "gain of its speed in a step"),
    )
    memory = (
        State("wanted", -2048.0, 2048.0, "rad/s"),
        State("turn", -1.0, 1.0, "ht"),
        State("speed_sum", -16.0, 16.0, "A"),
        State("sum_d", -VOLTAGE, VOLTAGE, "V"),
        State("sum_q", -VOLTAGE, VOLTAGE, "V"),
        State("u_a", -VOLTAGE, VOLTAGE, "V"),
        State("u_b", -VOLTAGE, VOLTAGE, "V"),
    )
    outputs = (
        # No tolerance: on given records the integrators of two controllers add up any difference.
        Output("u_a", "V"),
        Output("u_b", "V"),
        *Observer.outputs,
    )

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """The filter's prediction, and the voltage of the period that begins."""
        prior = super().f(x, u, p)
        return prior | self._controlled(prior, x, u, p)

    def _controlled(self, prior: dict[str, Any], x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Speed and current controllers, in rotor axes in the middle of its period."""
        forced = u.forced > 0.5
        slew = ops.where(forced, p.start_slew, p.slew)
        wanted = x.wanted + ops.clip(u.target - x.wanted, -slew, slew)
        error = wanted - x.omega
        speed_sum = ops.saturated(x.speed_sum + p.ki_w * error, CURRENT)
        torque = ops.saturated(p.kp_w * error + speed_sum, CURRENT)
        turn = ops.wrap_ht(x.turn + (DT / PI) * wanted)
        sine, cosine = ops.sincos_ht(ops.where(forced, turn, prior["theta"]))
        error_d = ops.where(forced, p.start_current, 0.0) - (
            cosine * prior["ia"] + sine * prior["ib"]
        )
        error_q = ops.where(forced, 0.0, torque) - (cosine * prior["ib"] - sine * prior["ia"])
        sum_d = ops.saturated(x.sum_d + p.ki_i * error_d, VOLTAGE)
        sum_q = ops.saturated(x.sum_q + p.ki_i * error_q, VOLTAGE)
        v_d, v_q = p.kp_i * error_d + sum_d, p.kp_i * error_q + sum_q
        return {
            "wanted": wanted,
            "turn": turn,
            "speed_sum": ops.where(forced, 0.0, speed_sum),
            "sum_d": sum_d,
            "sum_q": sum_q,
            "u_a": ops.saturated(cosine * v_d - sine * v_q, VOLTAGE),
            "u_b": ops.saturated(sine * v_d + cosine * v_q, VOLTAGE),
        }
