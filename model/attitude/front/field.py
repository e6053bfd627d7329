"""Calibration of a magnetometer: raw counts to field words."""

from __future__ import annotations

from typing import Any

from boresight.model.attitude.front.affine import AXES, counts, matrix_params, rows, vector_params
from boresight.model.estimator import Estimator, Output

FIELD_LIMIT = 256.0  #: uT, where fields are clamped.
#: uT per count: the HMR3300's example line is of the order of 4500 counts per gauss (inferred and
#: rough: calibrate; the heading needs ratios only).
FIELD_SCALE = 100.0 / 4500.0


class CalibrateField(Estimator):
    """Field in body axes from magnetometer counts, ``m = M (c - b)``.

    ``b`` is the hard iron in counts, ``M`` soft iron, scale, misalignment and mounting together:
    rows are body axes, columns sensor axes.
    """

    name = "calibrate_field"
    summary = "magnetometer counts to field words: hard and soft iron, mounting"
    inputs = counts(*(f"m{a}_counts" for a in AXES))
    params = (
        *matrix_params(
            "field",
            FIELD_SCALE,
            0.499,
            "uT per count",
            "soft iron, scale, misalignment and mounting of the magnetometer",
        ),
        *vector_params("field_bias", 32767.0, "counts", "hard iron, subtracted from the counts"),
    )
    states = ()
    outputs = tuple(Output(f"m{a}", "uT") for a in AXES)
    urgent = 3

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One magnetometer sample."""
        raw = [getattr(u, f"m{a}_counts") - getattr(p, f"field_bias_{a}") for a in AXES]
        field = rows(p, "field", raw, FIELD_LIMIT)
        return {}, {f"m{a}": value for a, value in zip(AXES, field, strict=True)}
