"""The attitude by the hardware core, in the soft core's memory: equality and cycles."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.sim.attitude.board.run import stimulus
from boresight.sim.attitude.soc.board import BoardBench, attitude_image
from boresight.sim.records.record import Record

__all__ = ["offload"]

#: Updates not compared, during the firmware's start-up.
_FIRST = 2


def offload(bench: BoardBench, log: Record, *, updates: int = 1000) -> dict[str, Any]:
    """Run the complete board: sensors at the pins, interrupt, attitude in memory.

    Every update's outputs in memory are compared with the integer model on the inputs that stand
    beside them.

    Parameters
    ----------
    bench : BoardBench
        Bench of `sim.attitude.soc.board.soc_board`.
    log : Record
        Data of the sensors, with a reference attitude for the compass.
    updates : int
        Number of updates.
    """
    image = attitude_image(bench.board.system, ram=bench.ram)
    run = bench.run(image, stimulus(log, bench.board), updates=updates)
    writes = run.newest
    program = bench.board.core.parts[0].program
    # Every parameter has its value after power-up.
    expected, _ = CModel(program).update(writes.inputs)
    numbers = (writes.header & 0xFFFF) - 1
    to_memory = (writes.complete - run.updates[numbers])[_FIRST:]
    to_update = run.updates - run.samples[: len(run.updates)]
    return {
        "estimator": program.name,
        "updates": len(run.updates),
        "in_memory": len(numbers),
        "mismatches": int((writes.outputs != expected).any(axis=1).sum()),
        "sample_to_update_cycles": {"min": int(to_update.min()), "max": int(to_update.max())},
        "update_to_memory_cycles": {
            "median": int(np.median(to_memory)),
            "max": int(to_memory.max()),
        },
        "code_bytes": image.code_size,
        "data_bytes": image.data_size,
        "setup": dataclasses.asdict(bench.board.setup),
        "simulated_cycles": run.cycles,
        "simulation_seconds": round(run.seconds, 2),
    }
