"""Common parts of the calibrations: 16-bit counts, 3x3 matrices as parameters, saturated rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from boresight.model import ops
from boresight.model.estimator import Input, Param

AXES = "xyz"
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def counts(*names: str, unit: str = "counts") -> tuple[Input, ...]:
    """Inputs of 16-bit two's complement words; a converter has no others, so none is watched."""
    return tuple(Input(name, -32768.0, 32767.0, unit, clamp=True) for name in names)


def matrix_params(
    name: str, scale: float, limit: float, unit: str, meaning: str
) -> tuple[Param, ...]:
    """Nine parameters ``name_rc``: row r a body axis, column c a sensor axis; scale * identity."""
    return tuple(
        Param(
            f"{name}_{row}{column}",
            scale if row == column else 0.0,
            -limit,
            limit,
            unit,
            f"{meaning}: body axis {row} from sensor axis {column}",
        )
        for row in AXES
        for column in AXES
    )


def vector_params(name: str, limit: float, unit: str, meaning: str) -> tuple[Param, ...]:
    """Three parameters ``name_x`` to ``name_z``, zero by default."""
    return tuple(
        Param(f"{name}_{a}", 0.0, -limit, limit, unit, f"{meaning}, axis {a}") for a in AXES
    )


def rows(
    p: Any, name: str, vector: Sequence[Any], limit: float, *, bias: str | None = None
) -> list[Any]:
    """Matrix ``name`` of the parameters times a vector, less ``bias``, clamped to +-``limit``."""
    out = []
    for row in AXES:
        total: Any = sum(
            getattr(p, f"{name}_{row}{c}") * v for c, v in zip(AXES, vector, strict=True)
        )
        if bias is not None:
            total = total - getattr(p, f"{bias}_{row}")
        out.append(ops.saturated(total, limit))
    return out
