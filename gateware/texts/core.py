"""The texts about a core: head of its Verilog, register map, README, instances, bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from boresight.gateware import registers
from boresight.gateware.bus.axi import AxiCore, axi_ports
from boresight.gateware.description import Description, Pin, Word
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.tools import kept_verilog
from boresight.model.arrays import BoolArray, IntArray
from boresight.model.declarations import EXACT_UNITS
from boresight.model.tools.c_names import comment, identifier, unique
from boresight.model.words.fixed import Format


def render(template: str, **context: Any) -> str:
    """The text of ``template``, a file name without ``.txt``."""
    return _environment().get_template(f"{template}.txt").render(context)


@cache
def _environment() -> Environment:
    """Environment with marks that do not occur in Verilog, VHDL, C or Python."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        block_start_string="[%",
        block_end_string="%]",
        variable_start_string="[[",
        variable_end_string="]]",
        comment_start_string="[#",
        comment_end_string="#]",
    )
    environment.globals.update(
        span=lambda bits: f"[{bits - 1}:0] " if bits > 1 else "",
        type=lambda bits: f"std_logic_vector({bits - 1} downto 0)" if bits > 1 else "std_logic",
        fixed=lambda word, frac: str(Format(word, frac)),
        table=_table,
        unique=unique,
    )
    environment.filters.update(
        cell=lambda text: " ".join(text.split()).replace("|", "\\|"),
        comment=comment,
        default_value=_default_value,
        example=_example,
        identifier=identifier,
        mhz=lambda hz: f"{hz / 1e6:g} MHz",
        number=lambda n: "INT32_MIN" if n == -(2**31) else f"({n})" if n < 0 else str(n),
        sentence=lambda text: text[0].upper() + text[1:].replace("\n", " "),
        # An extended identifier for names that are illegal as plain ones (two underscores).
        vhdl=lambda name: f"\\{name}\\" if "__" in name else name,
    )
    return environment


def _default_value(parameter: registers.Register) -> float:
    """The default of a parameter in its unit, after rounding to its word."""
    assert parameter.frac is not None and parameter.reset is not None
    return float(Format(32, parameter.frac).real(parameter.reset))


def _table(rows: Sequence[Sequence[object]]) -> str:
    texts = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    return "\n".join(
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in texts
    )


def _example(word: Word, bits: int) -> str:
    """A value in the middle of an input's range, but not 0, and its word."""
    low, high = word.low or 0.0, word.high or 0.0
    real = float(f"{(low + high) / 2 or high / 2:g}")
    quantised = int(Format(bits, word.frac).quantise(real)) & ((1 << bits) - 1)
    value = f"`{word.name}` = {real:g} {word.unit}".rstrip()
    return f"{value} is the word `0x{quantised:0{-(-bits // 4)}x}`"


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
    """A line for each input word, in the order of the runs; the head of the bench describes it."""
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
    """A line for each output word, as `input_hex`."""
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
    inputs = [*accumulate(run.inputs.size for run in runs)]
    outputs = [*accumulate(run.outputs.size for run in runs)]
    rows = [
        {
            **{"number": run.number, "name": core.programs[run.number].program},
            **{"records": len(run.inputs), "inputs": inputs[k], "outputs": outputs[k]},
        }
        for k, run in enumerate(runs)
    ]
    return {
        "runs": rows,
        "again": {"inputs": runs[0].inputs.shape[1], "outputs": runs[0].outputs.shape[1]},
        **{"inputs": inputs[-1], "outputs": outputs[-1], "digits": -(-core.word // 4)},
        "patience": 4 * max(program.interval for program in core.programs) + 200,
        "build": [*enumerate(core.build, registers.BUILD_LOW.address)],
        **{r.name: r.address for r in (registers.STATUS, registers.UPDATES, registers.RESTART)},
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
    """The register map as JSON, and as a C99 header: addresses, formats, ranges, bits, accessors.

    The header complements that of `firmware.emit.emit_c` for the same program.
    """
    mask = max(core.mask_of(register) for register in core.registers)
    header = render("registers.h", core=core, several=len(core.programs) > 1, read_mask=mask)
    return {"registers.h": header, "registers.json": core.to_json()}


def integration_names(*, generic: bool) -> list[str]:
    """Names of `integration_files`."""
    modules = (f"integration/{module}_instance" for module in ("core", "core_axi"))
    instances = (name + end for name in modules for end in (".v", ".vhd"))
    bench = ("Makefile", "tb.v", "tb_axi.v", "input.hex", "expected.hex")
    names = ["README.md", "core.core", "core_axi.v", *instances, *(f"tb/{name}" for name in bench)]
    return names if generic else [*names, PRIMITIVES]


def integration_files(
    core: Description,
    runs: Sequence[Recorded],
    *,
    generic: bool,
    area: Mapped | Routed | None = None,
) -> dict[str, str]:
    """Files that integrate a core into a design, by name: README, instances, bench, FuseSoC, AXI.

    ``runs`` are records of every program, in the order of the bench; ``generic``: ``core.v`` is
    without vendor primitives, so that no file describes these.
    """
    programs = ", ".join(program.program for program in core.programs)
    context = {
        **{"core": core, "word": core.word, "generic": generic},
        **{"several": len(core.programs) > 1, "program": registers.PROGRAM},
        "title": f"{programs}; configuration {core.configuration}, {core.word}-bit words.",
        "vlnv": f"{core.identifier}-{core.configuration}",
        "simulated": ["core.v"] if generic else ["core.v", PRIMITIVES],
        "records": sum(len(run.inputs) for run in runs),
    }
    out = {
        "README.md": render("readme.md", **context, exact_units=EXACT_UNITS, area=str(area or "")),
        "core.core": render("core.core", **context),
        "tb/Makefile": render("Makefile", **context),
        "tb/input.hex": input_hex(core, runs),
        "tb/expected.hex": expected_hex(core, runs),
    }
    if not generic:
        out[PRIMITIVES] = render(PRIMITIVES)
    ports = {"core": core.pins, "core_axi": tuple(Pin(*port) for port in axi_ports())}
    for module, (clock, reset, *data_ports) in ports.items():
        parts = {"module": module, "clock": clock.name, "reset": reset.name, "ports": data_ports}
        for end in ("v", "vhd"):
            text = render(f"instance.{end}", **context, **parts)
            out[f"integration/{module}_instance.{end}"] = text
        name = module.replace("core", "tb")
        bench = {"module": module, "name": name, "axi": module == "core_axi"}
        out[f"tb/{name}.v"] = render("tb.v", **{**context, **bench_context(core, runs), **bench})
    verilog = kept_verilog(lambda: AxiCore(word=core.word), "core_axi", core.word)
    out["core_axi.v"] = f"// AXI around the module core: see README.md.\n\n{verilog}"
    return out
