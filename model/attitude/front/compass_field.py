"""A compass's own heading as a field: the reading of a magnetometer that agrees with it."""

from __future__ import annotations

from typing import Any

from boresight.model import ops
from boresight.model.attitude.front.affine import AXES, IDENTITY, counts, rows
from boresight.model.attitude.front.field import FIELD_LIMIT
from boresight.model.estimator import Estimator, Output, Param

TENTH_HT = 1.0 / 1800.0  #: half turns in a tenth of a degree.


def _angle(name: str, scale: float, meaning: str) -> tuple[Param, Param]:
    return (
        Param(f"{name}_scale", scale, -9.7e-4, 9.7e-4, "ht per 0.1 deg", meaning),
        Param(f"{name}_offset_ht", 0.0, -1.0, 0.999, "ht", f"added to the {name}"),
    )


class CompassField(Estimator):
    """Equivalent field in body axes from a compass's heading, pitch and roll.

    By its angles the compass's attitude is ``C = Rz(psi) Rx(theta) Ry(gamma)``. The level field
    (north h, down v) in its axes is ``C^T (0, h, -v)``; a mounting matrix turns it from the
    compass's axes into the body's. Every filter then finds the compass's heading by its own tilt.

    Signs: compass headings run clockwise from north, psi counter-clockwise, so the scale of the
    heading is negative. Pitch and roll are taken as positive about x and y (nose up, right side
    down); which way a given compass counts is unverified: turn the sign of its scale.

    The vertical part is zero by default: then a small error of the compass's tilt does not turn
    the heading. The horizontal part is arbitrary, a field of usual strength.
    """

    name = "compass_field"
    summary = "compass heading, pitch and roll to the field that agrees with them"
    inputs = counts("heading_tenths", "pitch_tenths", "roll_tenths", unit="0.1 deg")
    params = (
        Param(
            "horizontal_ut",
            30.0,
            1.0,
            127.0,
            "uT",
            "level part of the field; what counts is that filters do not take it for disturbed",
        ),
        Param(
            "vertical_ut",
            0.0,
            -127.0,
            127.0,
            "uT",
            "downward part of the field; other than 0 "
            "it lets the compass's tilt errors into the heading",
        ),
        *_angle("heading", -TENTH_HT, "negative: the compass counts clockwise"),
        *_angle("pitch", TENTH_HT, "positive: nose up is positive"),
        *_angle("roll", TENTH_HT, "positive: right side down is positive"),
        *(
            Param(
                f"mount_{AXES[r]}{AXES[c]}",
                IDENTITY[r][c],
                -1.999,
                1.999,
                "",
                f"mounting: body axis {AXES[r]} from compass axis {AXES[c]}",
            )
            for r in range(3)
            for c in range(3)
        ),
    )
    states = ()
    outputs = tuple(Output(f"m{a}", "uT") for a in AXES)
    urgent = 3

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One line of the compass."""
        (sh, ch), (sp, cp), (sr, cr) = (
            ops.sincos_ht(
                ops.wrap_ht(
                    getattr(u, f"{name}_tenths") * getattr(p, f"{name}_scale")
                    + getattr(p, f"{name}_offset_ht")
                )
            )
            for name in ("heading", "pitch", "roll")
        )
        # Rz(-psi), then Rx(-theta), then Ry(-gamma) of (0, h, -v).
        east, north = p.horizontal_ut * sh, p.horizontal_ut * ch
        forward = ops.bounded(cp * north - sp * p.vertical_ut, -180.0, 180.0, "part of the field")
        up = ops.bounded(-(sp * north) - cp * p.vertical_ut, -180.0, 180.0, "part of the field")
        compass = (
            ops.bounded(cr * east - sr * up, -180.0, 180.0, "part of the field"),
            forward,
            ops.bounded(sr * east + cr * up, -180.0, 180.0, "part of the field"),
        )
        field = rows(p, "mount", compass, FIELD_LIMIT)
        return {}, {f"m{a}": value for a, value in zip(AXES, field, strict=True)}
