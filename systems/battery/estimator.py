"""State of charge of a lithium cell, from its current and voltage once a second.

The model is the equivalent circuit of Chen and Rincon-Mora, "Accurate electrical battery model
capable of predicting runtime and I-V performance", IEEE Transactions on Energy Conversion 21(2),
2006, of a polymer cell of 0.85 A h: a voltage that depends on the charge, a resistance, and two
elements of resistance and capacity in series. The filter takes for constants what the publication
lets depend on the charge; above a fifth of it they hardly do. A current is positive out of the
cell.
"""

from __future__ import annotations

from typing import Any

from boresight import Input, Output, Param, ops
from boresight.kalman import Kalman, Measurement, State

DT = 1.0  # s
CAPACITY = 0.85  # A h
#: Open-circuit voltage: A_0 + A_1 z + A_2 z^2 + A_3 z^3 + B exp(-C z) [V] of a charge z.
A_0, A_1, A_2, A_3, B, C = 3.685, 0.2156, -0.1178, 0.3201, -1.031, 35.0
R_0, R_FAST, R_SLOW = 0.07446, 0.04669, 0.04984  # ohm
C_FAST, C_SLOW = 703.6, 4475.0  # F
GONE_FAST, GONE_SLOW = (1.0 - ops.exp(-DT / rc) for rc in (R_FAST * C_FAST, R_SLOW * C_SLOW))
#: Charge below which the curve's exponential grows no steeper.
_EMPTY = 0.05


def open_voltage(z: Any) -> Any:
    """Open-circuit voltage [V] of a charge; its drop is a straight line below `_EMPTY`."""
    drop = B * ops.exp(-C * ops.maximum(z, _EMPTY))
    last = B * ops.exp(-C * _EMPTY)
    drop = ops.where(z < _EMPTY, last + (-C * last) * (z - _EMPTY), drop)
    return A_0 + z * (A_1 + z * (A_2 + z * A_3)) + drop


class Battery(Kalman):
    """State of charge of a lithium cell, from current and voltage."""

    inputs = (
        Input("i", -4.0, 4.0, "A", meaning="mean current of the step, positive out of the cell"),
        Input("v", 0.0, 5.0, "V", meaning="voltage at its end"),
    )
    params = (
        Param("capacity", CAPACITY, 0.25, 8.0, "A h", "charge of a full cell"),
        Param("r_0", R_0, 0.001, 0.5, "ohm", "resistance that acts at once"),
        Param("r_fast", R_FAST, 0.001, 0.5, "ohm", "resistance of the fast element"),
        Param("r_slow", R_SLOW, 0.001, 0.5, "ohm", "resistance of the slow element"),
        Param("gone_fast", GONE_FAST, 1e-4, 0.5, "", "1 - exp(-step / R C)"),
        Param("gone_slow", GONE_SLOW, 1e-4, 0.5, "", "1 - exp(-step / R C)"),
        Param("var_v", 9e-6, 1e-6, 1e-2, "V^2", "variance of a voltage"),
        Param("var_i", 1.6e-3, 1e-6, 1.0, "A^2", "variance of a current"),
        Param("q_v", 1e-10, 0.0, 1e-4, "V^2", "noise of either element in a step"),
    )
    states = (
        State("z", -0.25, 1.25, "", 0.5, sd=0.25, sd_max=0.35),
        State("v_fast", -1.0, 1.0, "V", sd=0.01, sd_max=0.03),
        State("v_slow", -1.0, 1.0, "V", sd=0.01, sd_max=0.03),
    )
    outputs = (
        Output("z", "", tolerance=3e-3),
        Output("v_fast", "V", tolerance=3e-3),
        Output("v_slow", "V", tolerance=3e-3),
        Output("sd_z", "", tolerance=2e-4),
        Output("nis", ""),
    )
    nis_freedom = 1
    floor = 2.0**-33

    def f(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Charge drawn, and the voltages of both elements."""
        G = self._by_current(p)
        return {
            "z": x.z + G["z"] * u.i,
            "v_fast": x.v_fast - p.gone_fast * x.v_fast + G["v_fast"] * u.i,
            "v_slow": x.v_slow - p.gone_slow * x.v_slow + G["v_slow"] * u.i,
        }

    def noise(self, x: Any, u: Any, p: Any) -> dict[Any, Any]:
        """One error of the current moves all three: G G^T var_i."""
        G = self._by_current(p)
        out: dict[Any, Any] = {(a, b): G[a] * G[b] * p.var_i for a in G for b in G if a < b}
        out |= {a: g * g * p.var_i + (0.0 if a == "z" else p.q_v) for a, g in G.items()}
        return out

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        """The voltage: its mean over the uncertain charge, and what its curvature adds to r.

        To the second order, with variance P of z: E h = h + h'' P / 2, and r has (h'' P)^2 / 2 in
        it. The current's own noise is in r, too.
        """
        bent = (2.0 * A_2 + 6.0 * A_3 * x.z) * x.p_z_z
        expected = open_voltage(x.z) + 0.5 * bent - p.r_0 * u.i - x.v_fast - x.v_slow
        noise = p.var_v + p.r_0 * (p.r_0 * p.var_i) + 0.5 * (bent * bent)
        return [Measurement(u.v, expected, noise)]

    def shown(self, x: Any, u: Any, p: Any) -> dict[str, Any]:
        """Standard deviation of the charge."""
        return {"sd_z": ops.sqrt(x.p_z_z)}

    @staticmethod
    def _by_current(p: Any) -> dict[str, Any]:
        """Changes of the states in a step, per ampere of mean current."""
        return {
            "z": (-DT / 3600.0) / p.capacity,
            "v_fast": p.r_fast * p.gone_fast,
            "v_slow": p.r_slow * p.gone_slow,
        }
