"""The whole board with a soft core in simulation: sensors at the pins, attitude in memory."""

from __future__ import annotations

import importlib.resources
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.firmware.emit import emit_c
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.firmware.soc.filter import filter_header
from boresight.firmware.soc.image import Image, build_image, source
from boresight.gateware.core import Core
from boresight.gateware.soc.attitude_soc import AttitudeSoc
from boresight.gateware.soc.cpu import cpu_verilog
from boresight.gateware.soc.layout import soc_header
from boresight.gateware.soc.memory import ram_verilog
from boresight.gateware.system.attitude_system import AttitudeSystem
from boresight.gateware.system.interface import Place
from boresight.gateware.system.system_bus import RESULTS
from boresight.gateware.texts.core import c_header
from boresight.gateware.texts.records import records_header
from boresight.gateware.verilog import to_verilog
from boresight.model.estimator import Estimator
from boresight.sim.board.build import Board, board_parameters, make_board
from boresight.sim.board.run import Stimulus, cycles_limit
from boresight.sim.board.setup import SCALED, Setup
from boresight.sim.rtl.compiled import Compiled, build

__all__ = ["BoardBench", "Watched", "attitude_files", "attitude_image", "soc_board"]

#: Files of the firmware that shows the attitude.
_FILES = ("main.c", "attitude.h", "attitude.c", "software.h", "software.c", "text.h", "text.c")
#: Words of ``attitude_t`` before its outputs, behind which the inputs stand: header, stamp, age.
_OUTPUTS = 3
#: Clock cycles per bit of the console: fast, so that text takes no long simulation.
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
        Whose registers it reads.
    software : Estimator, optional
        Estimator that the image has in software too.
    single : bool
        That as float C, not as integer C.
    ram : int
        Bytes of memory.
    """
    files, sources = attitude_files(system, software=software, single=single)
    return build_image(files, sources=sources, ram=ram, optimise=optimise)


def attitude_files(
    system: AttitudeSystem, *, software: Estimator | None = None, single: bool = False
) -> tuple[dict[str, str], list[str]]:
    """Texts of that firmware by file name, and which of them are compiled."""
    files = {name: source(name) for name in _FILES}
    sources = [name for name in _FILES if name.endswith(".c")]
    prefix = None
    if software is not None:
        word = system.core.machine.arithmetic.word
        made = emit_float_c(software) if single else emit_c(software.compile(word=word))
        prefix = float_prefix(software) if single else next(iter(made)).removesuffix(".h")
        files |= made
        sources.append(f"{prefix}.c")
    about = system.map()
    programs = about.programs[: system.plan.filters]
    number = 0 if software is None else system.plan.names.index(software.name)
    files |= {
        "filter.h": filter_header(prefix, single=single, number=number),
        "records.h": records_header(
            programs, outputs=RESULTS + Place.OUTPUTS, inputs=RESULTS + Place.INPUTS
        ),
        "registers.h": c_header(about),
        "soc_registers.h": soc_header(),
    }
    return files, sources


@dataclass(frozen=True)
class Watched:
    """What was seen of structures ``attitude_t`` in memory, each time all of one was written.

    Attributes
    ----------
    complete : int (n,)
        Cycle in which the last of its outputs was written.
    header : int (n,)
        Which update.
    outputs, inputs : int32 (n, 8), (n, 10)
        The hardware's results, and what they came from.
    computed : int32 (n, 8)
        The results as they became: by software, if it has computed them anew.
    age : int (n,)
        Cycles from data-ready until then.
    """

    complete: npt.NDArray[np.int64]
    header: npt.NDArray[np.int64]
    outputs: npt.NDArray[np.int32]
    inputs: npt.NDArray[np.int32]
    computed: npt.NDArray[np.int32]
    age: npt.NDArray[np.int64]


@dataclass(frozen=True)
class BoardSocRun:
    """What a run printed.

    Attributes
    ----------
    samples, updates : int (n,)
        Cycles of whole samples, and of updates in the registers.
    newest, shown : Watched
        What the interrupt has read; what the main loop has taken, and computed if by software.
    console : str
        Text.
    restarts : int
        How often the watchdog had to.
    cycles : int
    seconds : float
    """

    samples: npt.NDArray[np.int64]
    updates: npt.NDArray[np.int64]
    newest: Watched
    shown: Watched
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
        what: Stimulus,
        *,
        updates: int,
        after: int = 5000,
        keys: bytes = b"",
        keys_at: int = 0,
        faults: str = "",
    ) -> BoardSocRun:
        """Run until so many updates are done, and some cycles more.

        ``faults`` is the text of the ADIS16385's fault file; such updates as it costs come late.

        Raises
        ------
        SimulationFailed
            It hangs.
        """
        done = self.compiled.run(
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
            files={**what.files(), "firmware.hex": image.hex, "faults.txt": faults},
        )
        said: dict[str, list[list[str]]] = {kind: [] for kind in "SUABTW"}
        for line in done.stdout.splitlines():
            kind, *rest = line.split()
            if kind in said:
                said[kind].append(rest)

        def cycles(kind: str) -> npt.NDArray[np.int64]:
            return np.array([int(row[0]) for row in said[kind]], dtype=np.int64)

        console = bytes(int(row[0]) for row in said["T"]).decode("ascii", errors="replace")
        return BoardSocRun(
            cycles("S"),
            cycles("U"),
            _watched(said["A"], *_sizes(self.board)),
            _watched(said["B"], *_sizes(self.board)),
            console,
            len(said["W"]),
            done.cycles,
            done.seconds,
        )


def _sizes(board: Board) -> tuple[int, int]:
    """Most inputs and most outputs of a record."""
    programs = [part.program for part in board.core.parts[: board.system.plan.filters]]
    return max(len(p.streamed) for p in programs), max(len(p.outputs) for p in programs)


def _watched(rows: Sequence[Sequence[str]], inputs: int, outputs: int) -> Watched:
    """Structures from their words in the order of writing; one begins with its header.

    A header of 0 belongs to no update: updates count from 1 on.
    """
    behind = _OUTPUTS + outputs
    size = behind + inputs
    begun: list[dict[int, int]] = []  # words as they were first written
    later: list[dict[int, int]] = []  # and as they became
    at: list[int] = []
    for cycle, place, word in rows:
        k = int(place) % size
        if k == 0:
            begun.append({})
            later.append({})
            at.append(0)
        if begun:
            begun[-1].setdefault(k, int(word, 16))
            later[-1][k] = int(word, 16)
            if _OUTPUTS <= k < behind:
                at[-1] = int(cycle)
    whole = [n for n, words in enumerate(begun) if len(words) == size and words[0]]

    def table(words: Sequence[dict[int, int]]) -> npt.NDArray[np.uint32]:
        return np.array(
            [[words[n][k] for k in range(size)] for n in whole], dtype=np.uint32
        ).reshape(-1, size)

    first, final = table(begun), table(later)
    return Watched(
        np.array([at[n] for n in whole], dtype=np.int64),
        first[:, 0].astype(np.int64),
        first[:, _OUTPUTS:behind].view(np.int32),
        first[:, behind:].view(np.int32),
        final[:, _OUTPUTS:behind].view(np.int32),
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
        Speeds.
    core : Core, optional
        From `gateware.system.programs.system_core`; else one with these ``filters``.
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

    def own(package: str, name: str) -> str:
        return (importlib.resources.files(package) / name).read_text()

    sources = {
        "attitude_soc.sv": to_verilog(soc, "attitude_soc", instances=False),
        "VexRiscv.v": cpu_verilog(),
        "ram.v": ram_verilog(),
        "adis16385.sv": own("boresight.sim.devices", "adis16385.sv"),
        "hmr3300.sv": own("boresight.sim.devices", "hmr3300.sv"),
        "bench.sv": own("boresight.sim.soc", "board.sv"),
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
