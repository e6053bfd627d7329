"""Boards for the tests of several files: each built once, kept in the build cache."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from boresight.gateware.attitude.system.programs import system_core
from boresight.model.declarations import Input, Output
from boresight.model.estimator import Estimator
from boresight.sim.attitude.board.build import FASTER, SCALED, Board, make_board

#: Numbers of the filters of `shared_board`.
MEKF, COMPLEMENTARY = 0, 1


class Odd(Estimator):
    """Sensors in another order and other formats, registers, a held field, flags."""

    inputs = (
        Input("target", 0.0, 3.0, "m"),
        Input("az", -400.0, 400.0, "m/s^2"),
        Input("dt", 0.0, 0.1, "s"),
        Input("mx", -300.0, 300.0, "uT", missing="hold"),
        Input("offset", -1.0, 1.0, "m"),
        Input("mx_new", 0.0, 1.0, valid_of="mx"),
        Input("set_new", 0.0, 1.0, valid_of="target"),
        Input("gx", -100.0, 100.0, "rad/s"),
    )
    outputs = (
        Output("target", "m"),
        Output("force", "m/s^2"),
        Output("dt", "s"),
        Output("field", "uT"),
        Output("flags"),
        Output("rate", "rad/s"),
    )

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {
            "target": u.target,
            "force": 0.5 * u.az,
            "dt": 1.0 * u.dt,
            "field": 0.25 * u.mx,
            "flags": u.mx_new + 2.0 * u.set_new,
            "rate": 0.75 * u.gx + 0.25 * u.offset,
        }


@lru_cache
def shared_board() -> Board:
    """Two filters, 16 times as fast as the real one, with short waits after power-up and reset."""
    tick = {"calibrate_inertial": {"tick_s": FASTER / SCALED.clock_hz}}
    return make_board(SCALED, filters=("mekf", "complementary"), params=tick)


@lru_cache
def odd_board() -> Board:
    """`Odd` and a filter."""
    return make_board(SCALED, core=system_core([Odd, "complementary"]))
