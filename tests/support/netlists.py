"""A netlist beside the source that it was made of, in Verilator."""

from collections.abc import Mapping
from typing import Any

from boresight.sim.rtl.compiled import build
from boresight.sim.rtl.netlist import CELLS, verilog_of


def differences(
    bench: str,
    source: str,
    netlist: Mapping[str, Any],
    *,
    top: str,
    family: str,
    files: Mapping[str, str] | None = None,
) -> int:
    """What ``bench`` prints behind "differ": it has a module ``source`` and a netlist ``top``."""
    sources = {
        "source.v": source.replace(f"module {top}", "module source"),
        "netlist.v": verilog_of(netlist, top, CELLS[family]),
        **CELLS[family].sources(),
        "bench.sv": bench,
    }
    text = build("bench", sources).run(max_cycles=30_000, files=files).stdout
    return int(text.split("differ ")[1].split()[0])
