"""The paper's software figures measured again: float C, integer C and the hardware core.

The paper (its Figure 8) has 316 us for the complementary filter and 1.14 ms for the Kalman filter
of four states, C on a soft processor at 100 MHz.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.firmware.floating.text import operation_counts
from boresight.gateware.core import build_core
from boresight.model.arrays import FloatArray
from boresight.model.attitude import FILTERS, estimator
from boresight.model.estimator import Estimator, input_words
from boresight.sim.attitude.ma2014.paper import BESIDE, CYCLES
from boresight.sim.attitude.soc.measure import Measured, measure_float, measure_integer
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from boresight.sim.rotations.accuracy import largest_turn_deg
from boresight.sim.rotations.outputs import attitude_of

__all__ = ["FLOAT_BOUND_DEG", "PAPER_CYCLES", "compare", "compare_one"]

#: Cycles of the paper's C, by the filters most similar to its own.
PAPER_CYCLES = {name: CYCLES[BESIDE[name]] for name in ("complementary", "ekf_quaternion")}
#: Largest accepted difference between float C and the float reference, deg: the effect of single
#: precision over a few thousand updates (see tests/firmware/floating/test_build.py).
FLOAT_BOUND_DEG = 0.02


def _figures(run: Measured) -> dict[str, Any]:
    return {
        "updates": len(run.cycles),
        "cycles": {
            "min": int(run.cycles.min()),
            "median": int(np.median(run.cycles)),
            "max": int(run.cycles.max()),
        },
        "interrupt_to_result_cycles": {
            "median": int(np.median(run.response[1:])),
            "max": int(run.response[1:].max()),
        },
        "overhead_cycles": int((run.response - run.cycles)[1:].max()),
        "code_bytes": run.code,
        "data_bytes": run.data,
        "stack_bytes": run.stack,
        "simulation_seconds": round(run.seconds, 2),
    }


def _integer(e: Estimator, inputs: FloatArray, optimise: str) -> dict[str, Any]:
    program = e.compile()
    run = measure_integer(program, inputs, optimise=optimise)
    expected, _ = CModel(program).update(input_words(program, inputs[..., None])[..., 0])
    mismatches = (run.outputs.view(np.int32) != expected).any(axis=1)
    return {**_figures(run), "mismatches": int(mismatches.sum())}


def _single(e: Estimator, inputs: FloatArray, optimise: str) -> dict[str, Any]:
    run = measure_float(e, inputs, optimise=optimise)
    inputs = inputs.astype(np.float32).astype(np.float64)
    reference = e.run_float(inputs[..., None]).outputs
    values = run.outputs.view(np.float32).astype(np.float64)
    by_name = {o.name: values[:, k] for k, o in enumerate(e.outputs)}
    deviation = largest_turn_deg(
        attitude_of(by_name), attitude_of({k: v[:, 0] for k, v in reference.items()})
    )
    mismatches = by_name["status"] != reference["status"][:, 0]
    return {
        **_figures(run),
        "apart_deg": float(deviation),
        "bound_deg": FLOAT_BOUND_DEG,
        "status_mismatches": int(mismatches.sum()),
    }


def compare_one(
    name: str,
    log: Record,
    *,
    updates: int = 1000,
    optimise: str = "-Os",
    restarts: int | None = None,
) -> dict[str, Any]:
    """One estimator: float C, integer C on the simulated soft core, and the core's schedule.

    Parameters
    ----------
    name : str
        Estimator.
    log : Record
        Recorded data; its first ``updates`` samples are used.
    updates : int
        Number of samples.
    optimise : str
        Optimisation level of the compiler.
    restarts : int, optional
        Effort of the core's scheduler.

    Raises
    ------
    ToolMissing
        The cross compiler, or Verilator, is not installed.
    """
    e = estimator(name)
    inputs = feed(e, log.head(updates)).inputs
    single, integer = _single(e, inputs, optimise), _integer(e, inputs, optimise)
    core = build_core(e.compile(), "small", urgent=e.urgent, restarts=restarts)
    hardware = {"cycles": core.schedule.latency, "interval_cycles": core.schedule.interval}
    paper = PAPER_CYCLES.get(name)
    return {
        "estimator": name,
        "log": log.name,
        "float": single,
        "integer": integer,
        "hardware": hardware,
        "operations": operation_counts(e.trace()),
        "paper_cycles": paper,
        "ratios": {
            "float_to_paper": None if paper is None else single["cycles"]["median"] / paper,
            "float_to_integer": single["cycles"]["median"] / integer["cycles"]["median"],
            "integer_to_hardware": integer["cycles"]["median"] / hardware["cycles"],
            "float_to_hardware": single["cycles"]["median"] / hardware["cycles"],
        },
    }


def compare(
    log: Record,
    *,
    names: Sequence[str] = FILTERS,
    updates: int = 1000,
    optimise: str = "-Os",
    progress: Callable[[str], None] | None = None,
) -> list[dict[str, Any]]:
    """`compare_one` for each of ``names``."""
    rows = []
    for name in names:
        if progress is not None:
            progress(f"{name}: float and integer C on the soft core, {updates} updates each")
        rows.append(compare_one(name, log, updates=updates, optimise=optimise))
    return rows
