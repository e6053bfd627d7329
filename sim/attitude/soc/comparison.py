"""The paper's software figures measured again: float C, integer C and the core.

The paper (its Figure 8) has 316 us for the complementary filter and 1.14 ms for the Kalman filter
of four states, C on a soft processor at 100 MHz.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.model.attitude import estimator
from boresight.model.estimator import input_words
from boresight.sim.attitude.ma2014.paper import BESIDE, CYCLES
from boresight.sim.attitude.soc.measure import measure_float, measure_integer
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record
from boresight.sim.rotations.accuracy import largest_turn_deg
from boresight.sim.rotations.outputs import attitude_of

#: Cycles of the paper's C, by the filters most similar to its own.
PAPER_CYCLES = {name: CYCLES[BESIDE[name]] for name in ("complementary", "ekf_quaternion")}
#: Largest accepted difference between float C and the float reference, deg: the effect of single
#: precision over a few thousand updates (see tests/firmware/floating/test_build.py).
FLOAT_BOUND_DEG = 0.02


def compare(name: str, log: Record, *, updates: int) -> dict[str, Any]:
    """Run one filter as float C and as integer C on the soft core.

    Returns
    -------
    dict
        Median cycles of an update in each form and of the paper's C, bytes of code, how many
        updates of the integer C differ from the core's words, and how far the float C is from the
        float64 reference.

    Raises
    ------
    ToolMissing
        The cross compiler, or Verilator, is not installed.
    """
    e, program = estimator(name), estimator(name).compile()
    inputs = feed(e, log.head(updates)).inputs
    integer, single = measure_integer(program, inputs), measure_float(e, inputs)
    expected, _ = CModel(program).update(input_words(program, inputs[..., None])[..., 0])
    reference = e.run_float(inputs.astype(np.float32).astype(np.float64)[..., None]).outputs
    values = single.outputs.view(np.float32).astype(np.float64)
    apart = largest_turn_deg(
        attitude_of({o.name: values[:, k] for k, o in enumerate(e.outputs)}),
        attitude_of({k: v[:, 0] for k, v in reference.items()}),
    )
    core = build_core(program, "small", urgent=e.urgent)
    mismatches = int((integer.outputs.view(np.int32) != expected).any(axis=1).sum())
    return {
        "filter": name,
        "float": int(np.median(single.cycles)),
        "paper": PAPER_CYCLES.get(name),
        "integer": int(np.median(integer.cycles)),
        "core": core.schedule.latency,
        "float_bytes": single.code_bytes,
        "integer_bytes": integer.code_bytes,
        "updates": len(integer.cycles),
        "mismatches": mismatches,
        "apart_deg": float(apart),
        "good": not mismatches and apart <= FLOAT_BOUND_DEG and len(single.cycles) == len(inputs),
    }
