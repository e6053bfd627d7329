"""Levels by name."""

from __future__ import annotations

from collections.abc import Mapping

from boresight.gateware.core import build_core
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, with_params
from boresight.sim.levels.floating import CompiledFloat, NumpyFloat
from boresight.sim.levels.integer import Emitted, Interpreted
from boresight.sim.levels.level import Level
from boresight.sim.levels.rtl import Simulated

__all__ = ["LEVELS", "make_level"]

#: Float64 with numpy and compiled, integer interpreter, C, Verilog.
LEVELS = ("numpy", "float", "fixed", "c", "rtl")


def make_level(
    name: str,
    estimator: Estimator,
    *,
    config: str = "small",
    word: int = 32,
    params: Mapping[str, float] | None = None,
) -> Level:
    """One of `LEVELS`, ready to run.

    Raises
    ------
    InputError
        No such level or configuration; what fixed point cannot hold.
    ToolMissing
        A compiler or simulator is not installed.
    """
    if name not in LEVELS:
        raise InputError.at(
            "level", wanted=f"one of {', '.join(LEVELS)}", found=repr(name), fix="choose of these"
        )
    if name == "numpy":
        return NumpyFloat(estimator, params)
    if name == "float":
        return CompiledFloat(estimator, params)
    program = with_params(estimator.compile(word=word), estimator, params)
    if name == "fixed":
        return Interpreted(program)
    if name == "c":
        return Emitted(program)
    return Simulated(build_core(program, config))
