"""Area and timing of a Verilog design on the XC6SLX9, in one call."""

import os
from dataclasses import asdict, dataclass
from typing import Any, Final

from boresight.gateware.synthesis.device import Device
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import Netlist
from boresight.gateware.synthesis.spartan6.area import Area, count_area
from boresight.gateware.synthesis.spartan6.delays import GRADES, NET_MODELS
from boresight.gateware.synthesis.spartan6.device import XC6SLX9
from boresight.gateware.synthesis.timing import NOTE, Timing, analyse
from boresight.gateware.synthesis.yosys import synthesise

#: Loads on a net beyond which the statistics of routed nets say little.
_THIN: Final = 60


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Area and timing of a design, by yosys and the delay tables.

    Attributes
    ----------
    top : str
        Module name.
    device : Device
        The part.
    area : Area
        Primitive counts.
    timing : tuple of Timing
        One result per speed grade and net model.
    command, version : str
        Command and tool version that made the netlist.
    warnings : tuple of str
        Warnings about the figures.
    """

    top: str
    device: Device
    area: Area
    timing: tuple[Timing, ...]
    command: str
    version: str
    warnings: tuple[str, ...]

    def corner(self, *, grade: int = 2, nets: str = "median") -> Timing:
        """Return the timing of one speed grade and net model."""
        for timing in self.timing:
            if (timing.grade, timing.nets) == (grade, nets):
                return timing
        raise ValueError(f"corner must be grade 2 or 3, median or p75, not {(grade, nets)!r}")

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain JSON values, each number with its source and command."""
        counted = f"cells of the netlist by {self.version}"
        return {
            "top": self.top,
            "device": self.device.name,
            "tool": {"version": self.version, "command": self.command},
            "area": {
                key: {
                    "value": value,
                    "available": self.device.capacity(key),
                    "percent": self.device.percent(key, value),
                    "source": counted,
                    "available_source": self.device.resources[key].source,
                    "command": self.command,
                }
                for key, value in self.area.used().items()
            },
            "cells": dict(self.area.cells),
            "route_through": {
                "value": self.area.route_through,
                "source": counted,
                "command": self.command,
            },
            "timing": [_timing_json(t, self.command) for t in self.timing],
            "warnings": list(self.warnings),
        }


def _timing_json(timing: Timing, command: str) -> dict[str, Any]:
    return {
        "grade": timing.grade,
        "nets": timing.nets,
        "fmax_mhz": {"value": timing.fmax_mhz, "source": timing.source, "command": command},
        "period_ns": {"value": timing.period_ns, "source": timing.source, "command": command},
        "clocks": list(timing.clocks),
        "guessed": {name: asdict(delay) for name, delay in timing.guessed.items()},
        "worst": None if timing.worst is None else _path_json(asdict(timing.worst)),
        "ends": [_path_json(asdict(path)) for path in timing.ends],
        "groups": [
            {**asdict(g), "histogram": {str(k): n for k, n in g.histogram.items()}}
            for g in timing.groups
        ],
    }


def _path_json(path: dict[str, Any]) -> dict[str, Any]:
    points = [{**point, "keys": list(point["keys"])} for point in path["points"]]
    return {**path, "points": points}


def estimate(
    verilog: str,
    top: str,
    *,
    cache_dir: str | os.PathLike[str] | None = None,
    clock_mhz: float | None = None,
    device: Device = XC6SLX9,
) -> Estimate:
    """Synthesise ``verilog`` and estimate its area and its timing at all four corners.

    Parameters
    ----------
    verilog : str
        Verilog text that holds the module ``top`` and all it uses.
    top : str
        Top module.
    cache_dir : path, optional
        Folder that keeps netlists between calls; None keeps nothing.
    clock_mhz : float, optional
        Clock that slacks refer to; None: at each corner the highest one.
    device : Device
        Part whose capacity is compared with.

    Raises
    ------
    ToolMissing
        Yosys is not installed.
    SynthesisError
        Yosys rejected the design.
    UnknownCell, NetlistError
        The netlist has cells without timing.
    """
    synthesis = synthesise(verilog, top=top, cache_dir=cache_dir)
    netlist = Netlist.from_json(synthesis.netlist, top=top)
    area = count_area(netlist)
    graph = build_graph(netlist)
    timing = tuple(
        analyse(graph, grade=grade, nets=nets, clock_mhz=clock_mhz)
        for grade in GRADES
        for nets in NET_MODELS
    )
    return Estimate(
        top=top,
        device=device,
        area=area,
        timing=timing,
        command=synthesis.command,
        version=synthesis.version,
        warnings=_warnings(area, timing, device),
    )


def _warnings(area: Area, timing: tuple[Timing, ...], device: Device) -> tuple[str, ...]:
    warnings = [f"timing is an {NOTE}"]
    for key in area.overfull(device):
        used, available = area.used()[key], device.capacity(key)
        warnings.append(f"{key}: {used:g} needed, {device.name} has {available}")
    clocks = timing[0].clocks
    if len(clocks) > 1:
        warnings.append(
            f"{len(clocks)} clocks ({', '.join(clocks)}) are taken for one: paths between them "
            "are timed as if they met at every edge"
        )
    guessed = sorted({name for t in timing for name in t.guessed if name != "clock_uncertainty"})
    if guessed:
        warnings.append("worst paths depend on guessed constants: " + ", ".join(guessed))
    crowded = {p.net: p.fanout for t in timing if t.worst for p in t.worst.points}
    for net, fanout in crowded.items():
        if fanout > _THIN:
            warnings.append(
                f"a worst path crosses net {net} with {fanout} loads: few such nets stand behind "
                "the net delays, and this one may well be slower"
            )
    if timing[0].worst is None:
        warnings.append("no path from register to register: nothing limits the clock")
    return tuple(warnings)
