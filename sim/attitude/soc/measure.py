"""Software estimators on the simulated soft core: words, cycles, sizes, stack."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.firmware.attitude.filter import filter_header
from boresight.firmware.attitude.image import Image, build_image, source
from boresight.firmware.emit import emit_c
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.gateware.attitude.soc.layout import soc_header
from boresight.gateware.attitude.soc.system import Soc, soc_verilog
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.estimator import Estimator, input_words
from boresight.model.words.program import Program
from boresight.sim.rtl.compiled import Compiled, build

__all__ = [
    "DIVISOR",
    "RAM",
    "Measured",
    "measure_float",
    "measure_image",
    "measure_integer",
    "soc_bench",
]

#: Bytes of memory of the bench's soft core: more than the FPGA has, so that every estimator fits.
RAM = 256 * 1024
#: Clock cycles per bit of the console: the minimum.
DIVISOR = 8
#: Cycles after which an update counts as hung.
_UPDATE_LIMIT = 1_000_000


@dataclass(frozen=True)
class Measured:
    """Result of a run on the soft core.

    Attributes
    ----------
    outputs : uint32 (n, n_outputs)
        Words of the results.
    cycles : int64 (n,)
        Cycles of each update by the processor's counter, without those of reading it.
    response : int64 (n,)
        Cycles from the interrupt to the last word of the result, on the bus.
    stack : int
        Maximum stack in use, bytes.
    code, data : int
        Bytes of the image.
    seconds : float
        Wall clock of the simulation.
    """

    outputs: npt.NDArray[np.uint32]
    cycles: IntArray
    response: IntArray
    stack: int
    code: int
    data: int
    seconds: float


def soc_bench(*, ram: int = RAM, watchdog_cycles: int = 1 << 20) -> Compiled:
    """Build the bench; its firmware is the file ``firmware.hex`` in its working folder."""
    soc = Soc(words=ram // 4, divisor=DIVISOR, watchdog_cycles=watchdog_cycles)
    names = ("console.sv", "bench.sv")
    texts = {name: Path(__file__).with_name(name).read_text(encoding="utf-8") for name in names}
    return build("bench", soc_verilog(soc) | texts, parameters={"DIVISOR": DIVISOR})


def measure_image(
    image: Image, records: npt.NDArray[np.uint32], n_outputs: int, *, bench: Compiled | None = None
) -> Measured:
    """Run an image of ``measure.c`` on records (n, n_inputs)."""
    n, width = records.shape
    bench = bench or soc_bench(ram=image.ram)
    run = bench.run(
        {"records": n, "words": width},
        max_cycles=(n + 1) * _UPDATE_LIMIT,
        files={
            "firmware.hex": image.hex,
            "records.hex": "".join(f"{word:08x}\n" for word in records.ravel()),
        },
    )
    lines: dict[str, list[list[str]]] = {kind: [] for kind in "IODCVTW"}
    for line in run.stdout.splitlines():
        kind, *rest = line.split()
        if kind in lines:
            lines[kind].append(rest)
    figures = {int(index): int(word) for index, word in lines["V"]}

    def column(kind: str) -> IntArray:
        return np.array([int(row[0]) for row in lines[kind]], dtype=np.int64)

    outputs = np.array([int(row[0], 16) for row in lines["O"]], dtype=np.uint32)
    return Measured(
        outputs.reshape(n, n_outputs),
        column("C") - figures[6],
        column("D") - column("I"),
        figures[3],
        image.code_size,
        image.data_size,
        run.seconds,
    )


def _image(files: dict[str, str], name: str, *, ram: int, optimise: str) -> Image:
    return build_image(
        {
            **files,
            "filter.h": filter_header(name),
            "soc_registers.h": soc_header(),
            "measure.c": source("measure.c"),
        },
        sources=(f"{name}.c", "measure.c"),
        ram=ram,
        optimise=optimise,
    )


def integer_image(program: Program, *, ram: int = RAM, optimise: str = "-Os") -> Image:
    """Image of the measurement with a program as integer C."""
    files = emit_c(program)
    return _image(files, next(iter(files)).removesuffix(".h"), ram=ram, optimise=optimise)


def float_image(estimator: Estimator, *, ram: int = RAM, optimise: str = "-Os") -> Image:
    """Image of the measurement with an estimator as float C."""
    return _image(emit_float_c(estimator), float_prefix(estimator), ram=ram, optimise=optimise)


def measure_integer(program: Program, inputs: FloatArray, *, optimise: str = "-Os") -> Measured:
    """Run a program as integer C on inputs (n, n_inputs) in their units."""
    words = input_words(program, inputs[..., None])[..., 0].astype(np.int32).view(np.uint32)
    return measure_image(integer_image(program, optimise=optimise), words, len(program.outputs))


def measure_float(estimator: Estimator, inputs: FloatArray, *, optimise: str = "-Os") -> Measured:
    """Run an estimator as float C on inputs (n, n_inputs) in their units."""
    words = inputs.astype(np.float32).view(np.uint32)
    return measure_image(float_image(estimator, optimise=optimise), words, len(estimator.outputs))
