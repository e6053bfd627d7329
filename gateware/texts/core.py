"""The texts about a core: head of its Verilog, register map, README, instances, bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from boresight.gateware.bus.axi import AxiCore, axi_ports
from boresight.gateware.description import Description, Pin
from boresight.gateware.registers import BUILD_HIGH, BUILD_LOW, PROGRAM, RESTART, STATUS, UPDATES
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.texts.render import render
from boresight.gateware.verilog import to_verilog
from boresight.model.arrays import BoolArray, IntArray
from boresight.model.declarations import EXACT_UNITS

#: Marks of a line besides its word: of input and output; of input; of output.
LAST, PAUSES, SATURATED, BEYOND = 1, 2, 2, 4


@dataclass(frozen=True, eq=False)
class Recorded:
    """Records of one program of a core, from power-up on, and results of the integer model."""

    #: Number of the program.
    number: int
    #: int (n, n_inputs): The words of its input records.
    inputs: IntArray
    #: int (n, n_outputs): The words of its output records.
    outputs: IntArray
    #: bool (n,): Whether a result of the update was clamped, an input word beyond its range.
    saturated: BoolArray
    beyond: BoolArray

    @property
    def unhurried(self) -> int:
        """Number of leading records without pauses, whose cycles are compared."""
        return (len(self.inputs) + 1) // 2


def input_hex(core: Description, runs: Sequence[Recorded]) -> str:
    """A line ``cycles_marks_word`` for each input word, in the order of the runs.

    ``cycles`` are those since the first word of the record before, in the first word of a record;
    0 says that they are not compared. Of the marks 1 is the last word of the record, 2 that pauses
    are made.
    """
    lines = []
    for run in runs:
        interval, last = core.programs[run.number].interval, run.inputs.shape[1] - 1
        for k, record in enumerate(run.inputs.tolist()):
            cycles = interval if 0 < k < run.unhurried else 0
            for n, word in enumerate(record):
                marks = LAST * (n == last) + PAUSES * (k >= run.unhurried)
                lines.append(_line(cycles if n == 0 else 0, marks, word, core.word))
    return "".join(lines)


def expected_hex(core: Description, runs: Sequence[Recorded]) -> str:
    """A line ``cycles_marks_word`` for each output word, in the order of the runs.

    ``cycles`` are those since the first word of the input record, both counted; 0 says that they
    are not compared. Mark 1 is the last word of the record; with it, 2 says that the update
    saturated and 4 that an input word was beyond its range.
    """
    lines = []
    for run in runs:
        latencies, last = core.programs[run.number].latencies, run.outputs.shape[1] - 1
        for k, record in enumerate(run.outputs.tolist()):
            flags = LAST + SATURATED * bool(run.saturated[k]) + BEYOND * bool(run.beyond[k])
            for n, word in enumerate(record):
                cycles = latencies[n] if k < run.unhurried else 0
                lines.append(_line(cycles, flags * (n == last), word, core.word))
    return "".join(lines)


def _line(cycles: int, marks: int, value: int, word: int) -> str:
    digits = -(-word // 4)
    return f"{cycles:04x}_{marks:x}_{value & ((1 << word) - 1):0{digits}x}\n"


def bench_context(core: Description, runs: Sequence[Recorded]) -> dict[str, Any]:
    """Values of the bench besides the words."""
    inputs, outputs = (
        list(accumulate(words.size for words in side))
        for side in ([run.inputs for run in runs], [run.outputs for run in runs])
    )
    rows = [
        {
            "number": run.number,
            "name": core.programs[run.number].program,
            "records": len(run.inputs),
            "inputs": inputs[k],
            "outputs": outputs[k],
        }
        for k, run in enumerate(runs)
    ]
    return {
        "runs": rows,
        "again": {"inputs": runs[0].inputs.shape[1], "outputs": runs[0].outputs.shape[1]},
        "inputs": inputs[-1],
        "outputs": outputs[-1],
        "digits": -(-core.word // 4),
        "patience": 4 * max(program.interval for program in core.programs) + 200,
        "build": list(zip((BUILD_LOW.address, BUILD_HIGH.address), core.build, strict=True)),
        **{r.name: r.address for r in (STATUS, UPDATES, RESTART)},
    }


#: The register map: C header, and JSON.
REGISTER_FILES = ("registers.h", "registers.json")
#: Behaviour of the primitives in a ``core.v`` for Spartan-6.
PRIMITIVES = "spartan6.v"


def verilog_head(core: Description, *, instances: bool) -> str:
    """Comment for the head of `Core.verilog`."""
    names = ", ".join(program.program for program in core.programs)
    text = render("core.v", core=core, names=names, instances=instances)
    return "".join(f"// {line}".rstrip() + "\n" for line in text.splitlines()) + "\n"


def register_files(core: Description) -> dict[str, str]:
    """The register map by file name."""
    return {"registers.h": c_header(core), "registers.json": core.to_json()}


def c_header(core: Description) -> str:
    """The register map as a C99 header: addresses, formats, ranges, bits, accessors.

    It complements the header of `firmware.emit.emit_c` for the same program.
    """
    masks = [core.mask_of(register) for register in core.registers]
    return render("registers.h", core=core, several=len(core.programs) > 1, read_mask=max(masks))


def integration_names(*, generic: bool, axi: bool) -> list[str]:
    """Names of `integration_files`."""
    modules = ("core", "core_axi") if axi else ("core",)
    return [
        *("README.md", "core.core"),
        *(f"integration/{module}_instance{end}" for module in modules for end in (".v", ".vhd")),
        *("tb/Makefile", "tb/tb.v", "tb/input.hex", "tb/expected.hex"),
        *(() if generic else (PRIMITIVES,)),
        *(("core_axi.v", "tb/tb_axi.v") if axi else ()),
    ]


def integration_files(
    core: Description,
    runs: Sequence[Recorded],
    *,
    generic: bool,
    axi: bool,
    area: Mapped | Routed | None = None,
) -> dict[str, str]:
    """Files that integrate a core into a design, by name: README, instances, bench, FuseSoC, AXI.

    Parameters
    ----------
    runs : sequence of Recorded
        Records of every program, in the order in which the bench runs them.
    generic : bool
        Whether ``core.v`` is without vendor primitives, so that no file describes these.
    axi : bool
        Whether to add ``core_axi.v`` and its bench.
    area : Mapped or Routed, optional
        Area and clock.
    """
    names = integration_names(generic=generic, axi=axi)
    programs = ", ".join(program.program for program in core.programs)
    context = {
        **{"core": core, "word": core.word, "axi": axi, "generic": generic},
        **{"several": len(core.programs) > 1, "program": PROGRAM},
        "title": f"{programs}; configuration {core.configuration}, {core.word}-bit words.",
        "vlnv": f"{core.identifier}-{core.configuration}",
        "simulated": ["core.v"] if generic else ["core.v", PRIMITIVES],
        "benches": [Path(n).stem for n in names if n.startswith("tb/") and n.endswith(".v")],
        "records": sum(len(run.inputs) for run in runs),
    }
    out = {
        "README.md": render(
            "readme.md", **context, exact_units=EXACT_UNITS, area="" if area is None else str(area)
        ),
        "core.core": render("core.core", **context),
        "tb/Makefile": render("Makefile", **context),
        "tb/input.hex": input_hex(core, runs),
        "tb/expected.hex": expected_hex(core, runs),
    }
    if not generic:
        out[PRIMITIVES] = render(PRIMITIVES)
    ports = {"core": core.pins, "core_axi": tuple(Pin(*port) for port in axi_ports())}
    for module in ("core", "core_axi") if axi else ("core",):
        clock, reset, *data_ports = ports[module]
        parts = {"module": module, "clock": clock.name, "reset": reset.name, "ports": data_ports}
        for end in ("v", "vhd"):
            out[f"integration/{module}_instance.{end}"] = render(
                f"instance.{end}", **context, **parts
            )
        is_axi = module == "core_axi"
        name = "tb_axi" if is_axi else "tb"
        bench = {"module": module, "name": name, "axi": is_axi}
        out[f"tb/{name}.v"] = render("tb.v", **{**context, **bench_context(core, runs), **bench})
    if axi:
        verilog = to_verilog(AxiCore(word=core.word), "core_axi", instances=False)
        out["core_axi.v"] = f"// AXI around the module core: see README.md.\n\n{verilog}"
    return out
