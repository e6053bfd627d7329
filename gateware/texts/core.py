"""The texts about a core: head of its Verilog, register map, README, instances, bench."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any

from boresight.gateware.bus.axi_core import AxiCore, axi_ports
from boresight.gateware.description import Description, Pin, Records, Word
from boresight.gateware.registers.core import BUILD_HIGH, BUILD_LOW, PROGRAM, STATUS, UPDATES
from boresight.gateware.synthesis.estimate import Estimate
from boresight.gateware.texts.bench import Recorded, expected_hex, input_hex
from boresight.gateware.texts.render import render
from boresight.gateware.texts.wave import bus_drawing, record_drawing
from boresight.gateware.verilog import to_verilog
from boresight.model.declarations import EXACT_UNITS
from boresight.model.tools.c_names import identifier, unique
from boresight.model.words.fixed import Format

#: What the README says of words in these units.
_UNITS = {
    "ht": "`ht`: half turns, 1 is 180 degrees; the word wraps as the angle does.",
    "turn": "`turn`: turns from 0 to 1, the word read as an unsigned number.",
    **{
        unit: f"`{unit}`: the value is an integer, each of its bits for itself; its bit k is bit "
        "k + W - I of the word."
        for unit in EXACT_UNITS
    },
}
#: What the README says of each file.
_FILES = {
    "core.v": "module `core`, for synthesis",
    "core_sim.v": "the same, cycle by cycle, for simulation",
    "core_axi.v": "module `core_axi`: AXI4-Stream and AXI4-Lite around `core`",
    "registers.md": "registers, also as C header, SVD and JSON",
    "integration/": "instances in Verilog, VHDL, Amaranth and LiteX",
    "tb/": "a bench in plain Verilog with recorded words",
    "core.core": "for FuseSoC",
    "firmware/": "the same estimators in C, equal in every bit",
    "report.json": "everything that is known about it",
}
REGISTER_FILES = ("registers.h", "registers.json", "registers.md", "registers.svd")


def verilog_head(core: Description, *, instances: bool, identified: bool) -> str:
    """Comment for the head of `Core.verilog` with the same arguments."""
    names = ", ".join(program.program for program in core.programs)
    text = render("core.v", core=core, names=names, instances=instances, identified=identified)
    return "".join(f"// {line}".rstrip() + "\n" for line in text.splitlines()) + "\n"


def register_files(core: Description) -> dict[str, str]:
    """The register map by file name: C header, JSON, Markdown, CMSIS-SVD."""
    return {
        "registers.h": c_header(core),
        "registers.json": core.to_json(),
        "registers.md": render("registers.md", **_register_context(core)),
        "registers.svd": render("registers.svd", **_register_context(core)),
    }


def c_header(core: Description) -> str:
    """The register map as a C99 header: addresses, formats, ranges, bits, accessors.

    It goes together with the header of `firmware.emit.emit_c` for the same program.
    """
    return render("registers.h", **_register_context(core))


def _register_context(core: Description) -> dict[str, Any]:
    name = identifier(core.name)
    last = max(register.address for register in core.registers)
    built = dict(zip((BUILD_LOW.name, BUILD_HIGH.name), core.build, strict=True))
    resets = {r.address: built.get(r.name) if r.reset is None else r.reset for r in core.registers}
    masks = {r.address: core.mask_of(r) for r in core.registers}
    return {
        "core": core,
        "name": name,
        "macro": name.upper(),
        "several": len(core.programs) > 1,
        "records": list(_named_records(core)),
        "resets": {k: None if word is None else word & masks[k] for k, word in resets.items()},
        "read_mask": max(masks.values()),
        "memory": 0x1000 if last < 1024 else 4 << last.bit_length(),
    }


def _named_records(core: Description) -> Iterator[tuple[str, str, list[tuple[str, Word]]]]:
    """Of every record whether it is input or output, its program, and its words by C names."""
    taken = set(core.identifiers.values())
    for program in core.programs:
        of = f"{identifier(program.program)}_" if len(core.programs) > 1 else ""
        for title, kind, words in (
            ("input", "IN", program.inputs),
            ("output", "OUT", program.outputs),
        ):
            stems = unique((f"{of}{kind}_{word.name}" for word in words), taken=taken)
            taken.update(stems)
            yield title, program.program, list(zip(stems, words, strict=True))


def integration_names(*, axi: bool) -> list[str]:
    """Names of `integration_files`, known before any is made."""
    modules = ("core", "core_axi") if axi else ("core",)
    return [
        *("README.md", "core.core"),
        *(f"integration/{module}_instance{end}" for module in modules for end in (".v", ".vhd")),
        *("integration/core_amaranth.py", "integration/core_litex.py"),
        *("tb/Makefile", "tb/tb.v", "tb/input.hex", "tb/expected.hex"),
        *(("core_axi.v", "tb/tb_axi.v") if axi else ()),
    ]


def integration_files(
    core: Description,
    runs: Sequence[Recorded],
    *,
    generic: bool,
    axi: bool,
    area: Estimate | None = None,
) -> dict[str, str]:
    """What takes a core into a design, by file name: README, instances, bench, FuseSoC, AXI.

    Parameters
    ----------
    core : Description
        The core.
    runs : sequence of Recorded
        Records of every program, in the order in which the bench runs them.
    generic : bool
        ``core.v`` is without vendor primitives, and there is no ``core_sim.v``.
    axi : bool
        With ``core_axi.v`` and its bench.
    area : Estimate, optional
        Area and clock.
    """
    names = integration_names(axi=axi)
    written = {"core_axi.v": axi, "core_sim.v": not generic}
    programs = ", ".join(program.program for program in core.programs)
    context = {
        **{"core": core, "word": core.word, "axi": axi, "generic": generic},
        **{"several": len(core.programs) > 1, "program": PROGRAM},
        "title": f"{programs}; configuration {core.configuration}, {core.word}-bit words.",
        "vlnv": f"{identifier(core.name)}-{core.configuration}",
        "simulated": "core.v" if generic else "core_sim.v",
        "benches": [Path(n).stem for n in names if n.startswith("tb/") and n.endswith(".v")],
        "records": sum(len(run.inputs) for run in runs),
    }
    out = {
        "README.md": render(
            "readme.md",
            **context,
            files=[(name, what) for name, what in _FILES.items() if written.get(name, True)],
            units=_UNITS,
            examples=[_example(program, core.word) for program in core.programs],
            drawings=[record_drawing(p, core.word).markdown() for p in core.programs],
            bus_drawing=bus_drawing(core).markdown(),
            area=area,
            clock_mhz=None if area is None else area.corner(grade=2, nets="median").fmax_mhz,
        ),
        "core.core": render("core.core", **context),
        "integration/core_amaranth.py": render("amaranth.py", **context),
        "integration/core_litex.py": render("litex.py", **context),
        "tb/Makefile": render("Makefile", **context),
        "tb/input.hex": input_hex(core, runs),
        "tb/expected.hex": expected_hex(core, runs),
    }
    ports = {"core": core.pins, "core_axi": tuple(Pin(*port) for port in axi_ports())}
    for module in ("core", "core_axi") if axi else ("core",):
        clock, reset, *others = ports[module]
        parts = {"module": module, "clock": clock.name, "reset": reset.name, "ports": others}
        for end in ("v", "vhd"):
            out[f"integration/{module}_instance.{end}"] = render(
                f"instance.{end}", **context, **parts
            )
        around = module == "core_axi"
        name = "tb_axi" if around else "tb"
        bench = {**context, **_bench(core, runs), "module": module, "name": name, "axi": around}
        out[f"tb/{name}.v"] = render("tb.v", **bench)
    if axi:
        verilog = to_verilog(AxiCore(word=core.word), "core_axi", instances=False)
        out["core_axi.v"] = f"// AXI around the module core: see README.md.\n\n{verilog}"
    return out


def _example(program: Records, word: int) -> str:
    """A value of an input and its word."""
    first = program.inputs[0]
    real = (first.high or 0.0) / 2 or (first.low or 0.0) / 2
    quantised = int(Format(word, first.frac).quantise(real)) & ((1 << word) - 1)
    value = f"`{first.name}` = {real:g} {first.unit}".rstrip()
    return f"{value} is the word `0x{quantised:0{-(-word // 4)}x}`"


def _bench(core: Description, runs: Sequence[Recorded]) -> dict[str, Any]:
    """What the bench must know beside the words."""
    inputs, outputs = (
        list(accumulate(words.size for words in side))
        for side in ([run.inputs for run in runs], [run.outputs for run in runs])
    )
    rows = [
        {
            "number": run.number,
            "name": core.programs[run.number].program,
            "records": len(run.inputs),
            "source": run.source,
            "inputs": inputs[k],
            "outputs": outputs[k],
            "saturated": int(run.saturated[-1]),
        }
        for k, run in enumerate(runs)
    ]
    return {
        "runs": rows,
        "inputs": inputs[-1],
        "outputs": outputs[-1],
        "digits": -(-core.word // 4),
        "patience": 4 * max(program.interval for program in core.programs) + 200,
        "build": list(zip((BUILD_LOW.address, BUILD_HIGH.address), core.build, strict=True)),
        **{"status": STATUS.address, "updates": UPDATES.address},
    }
