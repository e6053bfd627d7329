"""``python -m boresight.sim.attitude.soc``: the paper's software figures, measured beside the core.

Its Figure 8 has 316 us for the complementary filter and 1.14 ms for the Kalman filter of four
states, C on a soft processor at 100 MHz. Beside its filters runs a program that uses the core
through the bus.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from boresight.firmware.attitude.image import build_image, source
from boresight.firmware.build import CModel
from boresight.firmware.emit import emit_c
from boresight.firmware.floating import emit_float_c, float_prefix
from boresight.gateware.attitude.soc import Soc, soc_verilog
from boresight.gateware.core import Core, build_core
from boresight.gateware.registers import RESTART, STATUS
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.attitude import FILTERS, estimator
from boresight.model.errors import InputError, ToolMissing, require
from boresight.model.estimator import Estimator, input_words
from boresight.model.tools.external import ToolFailed
from boresight.model.words.program import Program
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.attitude.ma2014.world import BESIDE, CLOCK_MHZ, TIME_US
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.record import Record
from boresight.sim.result import Result
from boresight.sim.rotations.accuracy import attitude_of, largest_turn_deg
from boresight.sim.rtl.simulators import SimulationFailed, build

#: Bytes of memory: more than an FPGA has, so that every filter fits.
_RAM = 256 * 1024
#: Cycles after which an update counts as hung.
_UPDATE_LIMIT = 1_000_000
#: Cycles of the paper's C, by the filters most similar to its own.
PAPER_CYCLES = {name: round(TIME_US[key] * CLOCK_MHZ) for name, key in BESIDE.items()}
#: Largest accepted difference between float C and the float reference, deg: the effect of single
#: precision over a few thousand updates (see tests/firmware/test_floating.py).
FLOAT_BOUND_DEG = 0.02


class Measured(NamedTuple):
    """A filter's run on the soft core.

    ``outputs`` (n, n_outputs) are the words of the results, ``cycles`` (n,) those of each update by
    the processor's counter, without those of reading it.
    """

    outputs: npt.NDArray[np.uint32]
    cycles: IntArray


def _measure(
    files: Mapping[str, str],
    prefix: str,
    records: npt.NDArray[np.uint32],
    outputs: int,
    core: Core | None = None,
) -> Measured:
    """Run ``measure.c`` with a filter's C on records (n, n_inputs)."""
    head = (
        f'#include "{prefix}.h"\n#define FILTER(name) {prefix}_##name\n'
        f"#define INPUTS {prefix.upper()}_INPUTS\n#define OUTPUTS {prefix.upper()}_OUTPUTS\n"
    )
    image = build_image(
        {**files, "filter.h": head, "measure.c": source("measure.c")},
        sources=(*(name for name in files if name.endswith(".c")), "measure.c"),
        ram=_RAM,
    )
    bench = Path(__file__).with_name("soc.sv").read_text(encoding="utf-8")
    n, width = records.shape
    run = build("bench", soc_verilog(Soc(words=_RAM // 4, core=core)) | {"bench.sv": bench}).run(
        {"records": n, "words": width},
        max_cycles=(n + 1) * _UPDATE_LIMIT,
        files={
            "firmware.hex": image,
            "records.hex": "".join(f"{word:08x}\n" for word in records.ravel()),
        },
    )
    lines = re.findall(r"(?m)^W ([0-9a-f]{8})$", run.stdout)
    words = np.array([int(word, 16) for word in lines], dtype=np.uint32)
    words = words[: len(words) // (1 + outputs) * (1 + outputs)].reshape(-1, 1 + outputs)
    return Measured(words[:, 1:], words[:, 0].astype(np.int64))


def measure_integer(program: Program, inputs: FloatArray) -> Measured:
    """Run a program as integer C on inputs (n, n_inputs) in their units."""
    files = emit_c(program)
    words = input_words(program, inputs[..., None])[..., 0].astype(np.int32).view(np.uint32)
    prefix = next(iter(files)).removesuffix(".h")
    return _measure(files, prefix, words, len(program.outputs))


def measure_float(estimator: Estimator, inputs: FloatArray) -> Measured:
    """Run an estimator as float C on inputs (n, n_inputs) in their units."""
    words = inputs.astype(np.float32).view(np.uint32)
    prefix = float_prefix(estimator, single=True)
    return _measure(emit_float_c(estimator, single=True), prefix, words, len(estimator.outputs))


def measure_core(core: Core, inputs: FloatArray) -> Measured:
    """Run the program that uses a core through the bus on inputs (n, n_inputs) in their units."""
    program = core.program
    words = input_words(program, inputs[..., None])[..., 0].astype(np.int32).view(np.uint32)
    numbers = {
        **{"INPUTS": len(program.inputs), "OUTPUTS": len(program.outputs)},
        **{"RESTART": RESTART.address, "STATUS": STATUS.address, "IDLE": STATUS.field("idle").mask},
    }
    sizes = "".join(f"#define CORE_{name} {number}u\n" for name, number in numbers.items())
    files = {"record.h": sizes, "core.h": source("core.h")}
    return _measure(files, "core", words, len(program.outputs), core)


def compare(name: str, log: Record, *, updates: int) -> dict[str, Any]:
    """Run one filter as float C and as integer C on the soft core.

    Figures: median cycles of an update in each form, of the paper's C, and of a program that uses
    the core through the ``bus``; how many updates of the integer C and of that program differ from
    the model's words, and how far the float C is from float64.
    """
    e, program = estimator(name), estimator(name).compile()
    inputs = feed(e, log.head(updates)).inputs
    integer, single = measure_integer(program, inputs), measure_float(e, inputs)
    expected, _ = CModel(program).update(input_words(program, inputs[..., None])[..., 0])
    exact = inputs.astype(np.float32).astype(np.float64)
    reference = make_level("numpy", Build(e)).run(exact).outputs
    values = single.outputs.view(np.float32).astype(np.float64)
    apart = largest_turn_deg(
        attitude_of({o.name: values[:, k] for k, o in enumerate(e.outputs)}), attitude_of(reference)
    )
    core = build_core(program, "small")
    used = measure_core(core, inputs)
    differ = [m.outputs.view(np.int32) != expected for m in (integer, used)]
    mismatches = sum(int(d.any(axis=1).sum()) for d in differ)
    return {
        "filter": name,
        "float": int(np.median(single.cycles)),
        "paper": PAPER_CYCLES.get(name),
        "integer": int(np.median(integer.cycles)),
        "core": core.schedule.latency,
        "bus": int(np.median(used.cycles)),
        "updates": len(integer.cycles),
        "mismatches": mismatches,
        "apart_deg": float(apart),
        "good": not mismatches and apart <= FLOAT_BOUND_DEG and len(single.cycles) == len(inputs),
    }


def main(arguments: Sequence[str]) -> int:
    """Print the figures; return 1 if words differ, 2 for bad usage or a missing compiler."""
    parser = argparse.ArgumentParser(prog="python -m boresight.sim.attitude.soc")
    parser.add_argument("filters", nargs="*", help="by default all four of the board")
    parser.add_argument("--updates", type=int, default=1000, help="recorded updates (%(default)s)")
    given = parser.parse_args(arguments)
    log = read_record(bundled("ximu_walk"))
    try:
        require(given.updates >= 1, "--updates", "1 or more", given.updates)
        for name in given.filters:
            wanted = "filters with outputs qw qx qy qz"
            require(gives_attitude(estimator(name)), "filters", wanted, name, "name others")
        rows = [compare(name, log, updates=given.updates) for name in given.filters or FILTERS]
    except (InputError, ToolMissing, ToolFailed, SimulationFailed) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    failures = [
        f"{row['filter']}: its C, or the core, differs from the model"
        for row in rows
        if not row["good"]
    ]
    result = Result({"software": rows}, {"Median cycles of an update": rows}, failures=failures)
    print(result)
    return int(not result.good)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
