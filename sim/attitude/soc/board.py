"""The whole board with a soft core in simulation: sensors at the pins, attitude in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.firmware.attitude.filter import filter_header
from boresight.firmware.attitude.image import Image, build_image, source
from boresight.firmware.emit import emit_c
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.gateware.attitude.soc.attitude_soc import AttitudeSoc
from boresight.gateware.attitude.soc.cpu import cpu_verilog
from boresight.gateware.attitude.soc.layout import soc_header
from boresight.gateware.attitude.soc.memory import ram_verilog
from boresight.gateware.attitude.system.attitude_system import AttitudeSystem
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.attitude.system.system_bus import RESULTS
from boresight.gateware.core import Core
from boresight.gateware.texts.core import c_header
from boresight.gateware.texts.records import records_header
from boresight.gateware.verilog import to_verilog
from boresight.model.arrays import IntArray
from boresight.model.estimator import Estimator
from boresight.sim.attitude.board.build import Board, bench_sources, board_parameters, make_board
from boresight.sim.attitude.board.run import Stimulus, cycles_limit
from boresight.sim.attitude.board.setup import SCALED, Setup
from boresight.sim.rtl.compiled import Compiled, build

__all__ = ["BoardBench", "AttitudeWrites", "attitude_files", "attitude_image", "soc_board"]

#: Files of the firmware that shows the attitude.
_FILES = ("main.c", "attitude.h", "attitude.c", "software.h", "software.c", "text.h", "text.c")
#: Words of ``attitude_t`` before its outputs: header, stamp, age. The inputs follow the outputs.
_OUTPUTS = 3
#: Clock cycles per bit of the console, few for a short simulation.
_CONSOLE_DIVISOR = 8


def attitude_image(
    system: AttitudeSystem,
    *,
    software: Estimator | None = None,
    single: bool = False,
    ram: int,
    optimise: str = "-Os",
) -> Image:
    """Firmware that shows the attitude.

    Parameters
    ----------
    system : AttitudeSystem
        System whose registers the firmware reads.
    software : Estimator, optional
        Estimator that the image also computes in software.
    single : bool
        Whether as float C instead of integer C.
    ram : int
        Bytes of memory.
    """
    files, sources = attitude_files(system, software=software, single=single)
    return build_image(files, sources=sources, ram=ram, optimise=optimise)


def attitude_files(
    system: AttitudeSystem, *, software: Estimator | None = None, single: bool = False
) -> tuple[dict[str, str], list[str]]:
    """Texts of the firmware by file name, and names of the files to compile."""
    files = {name: source(name) for name in _FILES}
    sources = [name for name in _FILES if name.endswith(".c")]
    prefix = None
    if software is not None:
        word = system.core.machine.arithmetic.word
        texts = emit_float_c(software) if single else emit_c(software.compile(word=word))
        prefix = float_prefix(software) if single else next(iter(texts)).removesuffix(".h")
        files |= texts
        sources.append(f"{prefix}.c")
    description = system.map()
    programs = description.programs[: system.plan.filters]
    number = 0 if software is None else system.plan.names.index(software.name)
    files |= {
        "filter.h": filter_header(prefix, single=single, number=number),
        "records.h": records_header(
            programs, outputs=RESULTS + Place.OUTPUTS, inputs=RESULTS + Place.INPUTS
        ),
        "registers.h": c_header(description),
        "soc_registers.h": soc_header(),
    }
    return files, sources


@dataclass(frozen=True)
class AttitudeWrites:
    """Complete structures ``attitude_t`` written to memory.

    Attributes
    ----------
    complete : int (n,)
        Cycle in which the last of its outputs was written.
    header : int (n,)
        Header of the update.
    outputs, inputs : int32 (n, 8), (n, 10)
        Outputs and inputs of the hardware.
    computed : int32 (n, 8)
        Final results: those of the software, if it computes them anew.
    age : int (n,)
        Cycles from data-ready to ``complete``.
    """

    complete: IntArray
    header: IntArray
    outputs: npt.NDArray[np.int32]
    inputs: npt.NDArray[np.int32]
    computed: npt.NDArray[np.int32]
    age: IntArray


@dataclass(frozen=True)
class BoardSocRun:
    """Output of a run.

    Attributes
    ----------
    samples, updates : int (n,)
        Cycles of whole samples, and of updates in the registers.
    newest, shown : AttitudeWrites
        Structures of the interrupt, and of the main loop with results of the software.
    console : str
        Text on the console.
    restarts : int
        Number of restarts by the watchdog.
    cycles : int
    seconds : float
    """

    samples: IntArray
    updates: IntArray
    newest: AttitudeWrites
    shown: AttitudeWrites
    console: str
    restarts: int
    cycles: int
    seconds: float


@dataclass(frozen=True)
class BoardBench:
    """The compiled bench of a board with a soft core."""

    board: Board
    compiled: Compiled
    ram: int

    def run(
        self,
        image: Image,
        stimulus: Stimulus,
        *,
        updates: int,
        after: int = 5000,
        keys: bytes = b"",
        keys_at: int = 0,
        faults: str = "",
    ) -> BoardSocRun:
        """Run until ``updates`` are complete, and ``after`` cycles more.

        ``faults`` is the text of the ADIS16385's fault file; it delays the updates that it costs.

        Raises
        ------
        SimulationFailed
            The simulation hangs.
        """
        result = self.compiled.run(
            {
                "updates": updates,
                "after": after,
                "adis_log": "adis.txt",
                "hmr3300_data": "hmr.txt",
                "watch_a": image.symbols["updates"],
                "watch_b": image.symbols["shown"],
                "keys": keys[::-1].hex() or "0",
                "keys_at": keys_at,
                **({"adis_faults": "faults.txt"} if faults else {}),
            },
            max_cycles=2 * cycles_limit(self.board, updates) + after,
            files={**stimulus.files(), "firmware.hex": image.hex, "faults.txt": faults},
        )
        lines: dict[str, list[list[str]]] = {kind: [] for kind in "SUABTW"}
        for line in result.stdout.splitlines():
            kind, *rest = line.split()
            if kind in lines:
                lines[kind].append(rest)

        def cycles(kind: str) -> IntArray:
            return np.array([int(row[0]) for row in lines[kind]], dtype=np.int64)

        console = bytes(int(row[0]) for row in lines["T"]).decode("ascii", errors="replace")
        return BoardSocRun(
            cycles("S"),
            cycles("U"),
            _attitude_writes(lines["A"], *_sizes(self.board)),
            _attitude_writes(lines["B"], *_sizes(self.board)),
            console,
            len(lines["W"]),
            result.cycles,
            result.seconds,
        )


def _sizes(board: Board) -> tuple[int, int]:
    """Maximum numbers of inputs and outputs of a record."""
    programs = [part.program for part in board.core.parts[: board.system.plan.filters]]
    return max(len(p.streamed) for p in programs), max(len(p.outputs) for p in programs)


def _attitude_writes(rows: Sequence[Sequence[str]], inputs: int, outputs: int) -> AttitudeWrites:
    """Structures from their words in the order of writing; each begins with its header.

    A header of 0 is not that of an update; updates count from 1 on.
    """
    inputs_start = _OUTPUTS + outputs
    size = inputs_start + inputs
    first_words: list[dict[int, int]] = []  # words as they were first written
    last_words: list[dict[int, int]] = []  # and as they were last written
    cycles: list[int] = []
    for cycle, index, word in rows:
        k = int(index) % size
        if k == 0:
            first_words.append({})
            last_words.append({})
            cycles.append(0)
        if first_words:
            first_words[-1].setdefault(k, int(word, 16))
            last_words[-1][k] = int(word, 16)
            if _OUTPUTS <= k < inputs_start:
                cycles[-1] = int(cycle)
    complete = [n for n, words in enumerate(first_words) if len(words) == size and words[0]]

    def table(words: Sequence[dict[int, int]]) -> npt.NDArray[np.uint32]:
        return np.array(
            [[words[n][k] for k in range(size)] for n in complete], dtype=np.uint32
        ).reshape(-1, size)

    first, final = table(first_words), table(last_words)
    return AttitudeWrites(
        np.array([cycles[n] for n in complete], dtype=np.int64),
        first[:, 0].astype(np.int64),
        first[:, _OUTPUTS:inputs_start].view(np.int32),
        first[:, inputs_start:].view(np.int32),
        final[:, _OUTPUTS:inputs_start].view(np.int32),
        final[:, 2].astype(np.int64),
    )


def soc_board(
    setup: Setup = SCALED,
    *,
    core: Core | None = None,
    ram: int = 64 * 1024,
    filters: Sequence[str] = ("mekf",),
) -> BoardBench:
    """Build the bench.

    Parameters
    ----------
    setup : Setup
        Speeds of the board.
    core : Core, optional
        Of `gateware.attitude.system.programs.system_core`; by default with these ``filters``.
    ram : int
        Bytes of the soft core's memory.
    """
    board = make_board(setup, core=core, filters=filters, wishbone=True)
    words = _OUTPUTS + sum(_sizes(board))
    soc = AttitudeSoc(
        system=board.system,
        words=ram // 4,
        console_baud=setup.clock_hz / _CONSOLE_DIVISOR,
        watchdog_cycles=1 << 20,
    )

    sources = {
        "attitude_soc.sv": to_verilog(soc, "attitude_soc", instances=False),
        "VexRiscv.v": cpu_verilog(),
        "ram.v": ram_verilog(),
        "console.sv": Path(__file__).with_name("console.sv").read_text(encoding="utf-8"),
        **bench_sources("boresight.sim.attitude.soc", "board.sv"),
    }
    return BoardBench(
        board,
        build(
            "bench",
            sources,
            parameters={
                **board_parameters(setup),
                "CONSOLE_DIVISOR": _CONSOLE_DIVISOR,
                "WATCH_A": 3 * words,
                "WATCH_B": words,
            },
        ),
        ram,
    )
