"""A program that uses the core through the bus: every update of the attitude system, in memory."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.firmware.attitude.image import build_image, source
from boresight.firmware.build import CModel
from boresight.gateware.attitude.soc.attitude_soc import AttitudeSoc
from boresight.gateware.attitude.soc.system import soc_verilog
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.attitude.system.system_bus import RESULTS
from boresight.gateware.texts.core import c_header
from boresight.sim.attitude.board.build import SCALED, board_parameters, board_sources, make_board
from boresight.sim.attitude.board.run import cycles_limit, files_and_arguments, stimulus
from boresight.sim.attitude.board.trace import read_trace
from boresight.sim.attitude.soc.measure import printed_words
from boresight.sim.records.record import Record
from boresight.sim.rtl.compiled import build

_RAM = 64 * 1024


def offload(log: Record, *, filters: Sequence[str] = ("mekf",), updates: int) -> dict[str, Any]:
    """Simulate the complete board with the soft core that reads its updates.

    Every update in the program's memory is compared with the integer model on the inputs beside it.

    Parameters
    ----------
    log : Record
        Data of the sensors, with a reference attitude for the compass.
    filters : sequence of str
        Filters of the board; the first one runs.
    updates : int
        Number of updates.
    """
    board = make_board(SCALED, filters=filters, wishbone=True)
    system, program = board.system, board.core.parts[0].program
    outputs, inputs = len(program.outputs), len(program.inputs)
    sizes = {
        "RECORD_OUTPUTS": outputs,
        "RECORD_INPUTS": inputs,
        "RECORD_OUTPUT_ADDR": RESULTS + Place.OUTPUTS,
        "RECORD_INPUT_ADDR": RESULTS + Place.INPUTS,
    }
    image, _ = build_image(
        {
            "records.h": "".join(f"#define {name} {int(n)}u\n" for name, n in sizes.items()),
            "registers.h": c_header(system.map()),
            "offload.c": source("offload.c"),
        },
        sources=("offload.c",),
        ram=_RAM,
    )
    soc = soc_verilog(AttitudeSoc(system=system, words=_RAM // 4), "system")
    bench = build(
        "bench",
        {"soc.v": "`define SOC\n", **board_sources(board), **soc},
        parameters=board_parameters(board.setup),
    )
    files, arguments = files_and_arguments(board, stimulus(log, board), updates, {}, {})
    with tempfile.TemporaryDirectory(prefix="boresight-offload-") as folder:
        run = bench.run(
            arguments,
            max_cycles=cycles_limit(board, updates),
            files={**files, "firmware.hex": image},
            folder=Path(folder),
        )
        trace = read_trace((Path(folder) / "trace.txt").read_text())
    words = printed_words(run.stdout, 2 + outputs + inputs)
    expected, _ = CModel(program).update(words[:, 2 + outputs :].view(np.int32))
    computed = words[:, 2 : 2 + outputs].view(np.int32)
    numbers = words[:, 0].astype(np.int64) & 0xFFFF
    ready = trace.ready[np.searchsorted(trace.ready[:, 0], trace.updates) - 1, 0]
    in_registers = (trace.updates - ready)[numbers - 1]
    return {
        "filter": program.name,
        "updates": len(trace.updates),
        "in_memory": len(words),
        "mismatches": int((computed != expected).any(axis=1).sum()),
        "bus_cycles": int(np.max(words[:, 1].astype(np.int64) - in_registers)),
    }
