"""Filters in C on the simulated soft core: words of the results, and cycles of each update."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from boresight.firmware.attitude.image import build_image, source
from boresight.firmware.emit import emit_c
from boresight.firmware.floating.emit import emit_float_c, float_prefix
from boresight.gateware.attitude.soc.system import Soc, soc_verilog
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.estimator import Estimator, input_words
from boresight.model.words.program import Program
from boresight.sim.rtl.compiled import Compiled, build

#: Bytes of memory: more than an FPGA has, so that every filter fits.
_RAM = 256 * 1024
#: Cycles after which an update counts as hung.
_UPDATE_LIMIT = 1_000_000


@dataclass(frozen=True)
class Measured:
    """A filter's run on the soft core.

    Attributes
    ----------
    outputs : uint32 (n, n_outputs)
        Words of the results.
    cycles : int64 (n,)
        Cycles of each update by the processor's counter, without those of reading it.
    code_bytes : int
        Size of the image.
    """

    outputs: npt.NDArray[np.uint32]
    cycles: IntArray
    code_bytes: int


def _bench() -> Compiled:
    bench = Path(__file__).with_name("bench.sv").read_text(encoding="utf-8")
    return build("bench", soc_verilog(Soc(words=_RAM // 4), "soc") | {"bench.sv": bench})


def printed_words(stdout: str, width: int) -> npt.NDArray[np.uint32]:
    """Return the words that a bench printed, ``width`` in a row."""
    lines = re.findall(r"(?m)^W ([0-9a-f]{8})$", stdout)
    words = np.array([int(word, 16) for word in lines], dtype=np.uint32)
    return words[: len(words) // width * width].reshape(-1, width)


def _measure(
    files: Mapping[str, str], prefix: str, records: npt.NDArray[np.uint32], outputs: int
) -> Measured:
    """Run ``measure.c`` with a filter's C on records (n, n_inputs)."""
    head = (
        f'#include "{prefix}.h"\n#define FILTER(name) {prefix}_##name\n'
        f"#define INPUTS {prefix.upper()}_INPUTS\n#define OUTPUTS {prefix.upper()}_OUTPUTS\n"
    )
    image = build_image(
        {**files, "filter.h": head, "measure.c": source("measure.c")},
        sources=(f"{prefix}.c", "measure.c"),
        ram=_RAM,
    )
    n, width = records.shape
    run = _bench().run(
        {"records": n, "words": width},
        max_cycles=(n + 1) * _UPDATE_LIMIT,
        files={
            "firmware.hex": image.hex,
            "records.hex": "".join(f"{word:08x}\n" for word in records.ravel()),
        },
    )
    words = printed_words(run.stdout, 1 + outputs)
    return Measured(words[:, 1:], words[:, 0].astype(np.int64), image.code_bytes)


def measure_integer(program: Program, inputs: FloatArray) -> Measured:
    """Run a program as integer C on inputs (n, n_inputs) in their units."""
    files = emit_c(program)
    words = input_words(program, inputs[..., None])[..., 0].astype(np.int32).view(np.uint32)
    prefix = next(iter(files)).removesuffix(".h")
    return _measure(files, prefix, words, len(program.outputs))


def measure_float(estimator: Estimator, inputs: FloatArray) -> Measured:
    """Run an estimator as float C on inputs (n, n_inputs) in their units."""
    words = inputs.astype(np.float32).view(np.uint32)
    prefix = float_prefix(estimator)
    return _measure(emit_float_c(estimator), prefix, words, len(estimator.outputs))
