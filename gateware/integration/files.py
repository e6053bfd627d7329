"""The files that take a core into a design: README, instances, bench, FuseSoC, AXI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from boresight.gateware.core import Core
from boresight.gateware.core_text import core_ports
from boresight.gateware.integration.axi_core import AxiCore, axi_ports
from boresight.gateware.integration.bench import Recorded, expected_hex, input_hex
from boresight.gateware.integration.readme import readme_context
from boresight.gateware.register_map import register_map
from boresight.gateware.registers.core import FIXED, PROGRAM
from boresight.gateware.verilog import to_verilog
from boresight.model.tools.c_names import identifier

__all__ = ["integration_files", "integration_names"]


def integration_names(*, axi: bool) -> list[str]:
    """Names of the files, known before any is made."""
    modules = ("core", "core_axi") if axi else ("core",)
    return [
        *("README.md", "core.core"),
        *(f"integration/{module}_instance{end}" for module in modules for end in (".v", ".vhd")),
        *("integration/core_amaranth.py", "integration/core_litex.py"),
        *("tb/Makefile", "tb/tb.v", "tb/input.hex", "tb/expected.hex"),
        *(("core_axi.v", "tb/tb_axi.v") if axi else ()),
    ]


def integration_files(
    core: Core,
    runs: Sequence[Recorded],
    *,
    summaries: Mapping[str, str],
    generic: bool,
    axi: bool,
    resources: str,
) -> dict[str, str]:
    """Texts by file name.

    Parameters
    ----------
    core : Core
        The core.
    runs : sequence of Recorded
        Records of every program, in the order in which the bench runs them.
    summaries : mapping
        A line about each program, by its name.
    generic : bool
        ``core.v`` is without vendor primitives, and there is no ``core_sim.v``.
    axi : bool
        With ``core_axi.v`` and its bench.
    resources : str
        What is known about area and clock.
    """
    word, environment = core.machine.arithmetic.word, _environment()
    names = integration_names(axi=axi)
    context = {
        **{"core": core, "word": word, "axi": axi, "generic": generic, "resources": resources},
        **{"several": len(core.parts) > 1, "program": PROGRAM},
        "title": f"{', '.join(core.names)}; configuration {core.machine.name}, {word}-bit words.",
        "vlnv": f"{identifier(core.name)}-{core.machine.name}",
        "simulated": "core.v" if generic else "core_sim.v",
        "benches": [Path(n).stem for n in names if n.startswith("tb/") and n.endswith(".v")],
        "records": sum(len(run.inputs) for run in runs),
        "files": [(name, what) for name, what in _WHAT.items() if _written(name, names, generic)],
    }

    def text(template: str, **more: Any) -> str:
        return environment.get_template(f"{template}.txt").render({**context, **more})

    instances = {"core": core_ports(word), **({"core_axi": axi_ports()} if axi else {})}
    out = {
        "README.md": text("readme.md", **readme_context(core, summaries)),
        "core.core": text("core.core"),
        "integration/core_amaranth.py": text("amaranth.py"),
        "integration/core_litex.py": text("litex.py"),
        "tb/Makefile": text("Makefile"),
        "tb/input.hex": input_hex(core, runs),
        "tb/expected.hex": expected_hex(core, runs),
    }
    for module, ports in instances.items():
        (_, clock, *_), (_, reset, *_), *others = ports
        for end in ("v", "vhd"):
            out[f"integration/{module}_instance.{end}"] = text(
                f"instance.{end}",
                **{"module": module, "clock": clock, "reset": reset},
                ports=[port[:3] for port in others],
            )
        around = module == "core_axi"
        name = "tb_axi" if around else "tb"
        bench = {**_bench(core, runs), "module": module, "name": name, "axi": around}
        out[f"tb/{name}.v"] = text("tb.v", **bench)
    if axi:
        verilog = to_verilog(AxiCore(word=word), "core_axi", instances=False)
        out["core_axi.v"] = f"// AXI around the module core: see README.md.\n\n{verilog}"
    return out


#: What the README says of each file.
_WHAT = {
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


def _written(name: str, names: Sequence[str], generic: bool) -> bool:
    """Whether a file of `_WHAT` is there: those of AXI and core_sim.v need not be."""
    return {"core_axi.v": name in names, "core_sim.v": not generic}.get(name, True)


def _bench(core: Core, runs: Sequence[Recorded]) -> dict[str, Any]:
    """What the bench must know beside the words."""
    address = {register.name: register.address for register in FIXED}
    ends = [
        list(accumulate(words.size for words in side))
        for side in ([run.inputs for run in runs], [run.outputs for run in runs])
    ]
    rows = [
        {
            "number": run.number,
            "name": core.names[run.number],
            "records": len(run.inputs),
            "source": run.source,
            "inputs": ends[0][k],
            "outputs": ends[1][k],
            "saturated": int(run.saturated[-1]),
        }
        for k, run in enumerate(runs)
    ]
    return {
        "runs": rows,
        "inputs": ends[0][-1],
        "outputs": ends[1][-1],
        "digits": -(-core.machine.arithmetic.word // 4),
        "patience": 4 * max(part.schedule.interval for part in core.parts) + 200,
        "build": list(
            zip(
                (address["build_low"], address["build_high"]), register_map(core).build, strict=True
            )
        ),
        **{"status": address["status"], "updates": address["updates"]},
    }


@cache
def _environment() -> Environment:
    """Templates whose marks are none of Verilog's, VHDL's or Python's."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).with_name("texts")),
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
    environment.globals.update(span=_span, type=_vhdl_type, vhdl=_vhdl_name)
    return environment


def _span(bits: int) -> str:
    """``[7:0] `` in Verilog, nothing for a single bit."""
    return f"[{bits - 1}:0] " if bits > 1 else ""


def _vhdl_type(bits: int) -> str:
    return f"std_logic_vector({bits - 1} downto 0)" if bits > 1 else "std_logic"


def _vhdl_name(name: str) -> str:
    """An extended identifier where a plain one may not be: two underscores."""
    return f"\\{name}\\" if "__" in name else name
