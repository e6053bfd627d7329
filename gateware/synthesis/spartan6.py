"""Estimate the clock of a Spartan-6 netlist by its longest path from register to register.

No open tool routes a Spartan-6. The estimate adds the delays of the cells on a path (in
``spartan6.csv``: constants of published ISE timing reports, or guesses) and a delay for each net:
the median or the upper quartile of routed nets with the same fan-out. The two clocks are the band
of the estimate; ISE's ``trce`` gives the true one. Paths through the ports of the module are not
counted, all registers are on one clock, and no path is false or multi-cycle.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any, Final, NamedTuple

from boresight.gateware.synthesis.family import ClockEstimate
from boresight.gateware.synthesis.tools import SynthesisError

#: Statistics of routed nets: an optimistic and a pessimistic one.
_NETS: Final = ("median", "p75")
_CLOCK: Final = "clock"


class _Pin(NamedTuple):
    """A bit of a port of a cell."""

    cell: str
    port: str
    bit: int


class _Edge(NamedTuple):
    """Through a cell: from input ``load``, or its clock (None), to an output, or to its clock."""

    load: _Pin | None
    ns: float


@cache
def _delays(grade: int) -> tuple[Mapping[str, Any], Mapping[str, Mapping[str, float]]]:
    """Delays of a grade [ns]: of cells by type (from, to, when, delay), of nets by most loads."""
    cells: dict[str, list[tuple[str, str, str, float]]] = defaultdict(list)
    nets: dict[str, dict[str, float]] = defaultdict(dict)
    with Path(__file__).with_name("spartan6.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            ns = float(row[f"ns_{grade}"])
            if row["cells"] == "net":
                for model in [row["when"]] if row["when"] else _NETS:
                    nets[model][row["to"]] = ns
                continue
            for kind in row["cells"].split():
                cells[kind].append((row["from"], row["to"], row["when"], ns))
    return cells, nets


def _holds(parameters: Mapping[str, object], condition: str) -> bool:
    """Whether all words of a condition hold: ``A0REG|A1REG``, one is not 0; ``!MREG``, not."""
    return all(
        any(str(parameters.get(name) or "").strip("0") for name in word.lstrip("!").split("|"))
        != word.startswith("!")
        for word in condition.split()
    )


def _matching(pins: Sequence[_Pin], pattern: str) -> list[_Pin]:
    """Pins of a pattern, ``I*`` or ``O.0``."""
    return [pin for pin in pins if fnmatchcase(f"{pin.port}.{pin.bit}", pattern)]


class _Graph:
    """What feeds each net of a flat module, and where paths end, at one speed grade."""

    def __init__(self, module: Mapping[str, Any], grade: int) -> None:
        self.cells: Mapping[str, Mapping[str, Any]] = module["cells"]
        arcs, self.delays = _delays(grade)
        self.driver: dict[int, _Pin] = {}
        self.loads: dict[int, list[_Pin]] = defaultdict(list)
        self.into: dict[int, list[_Edge]] = defaultdict(list)
        self.ends: list[_Edge] = []
        for name, cell in self.cells.items():
            ends: dict[str, list[_Pin]] = {"input": [], "output": []}
            for port, bits in cell["connections"].items():
                pins = (_Pin(name, port, k) for k, bit in enumerate(bits) if isinstance(bit, int))
                ends[cell["port_directions"][port]] += pins
            self.driver |= {self.net(pin): pin for pin in ends["output"]}
            for pin in ends["input"]:
                self.loads[self.net(pin)].append(pin)
            for source, target, when, ns in arcs.get(cell["type"], ()):
                if not _holds(cell.get("parameters", {}), when):
                    continue
                starts = [None] if source == _CLOCK else _matching(ends["input"], source)
                if target == _CLOCK:
                    self.ends += [_Edge(start, ns) for start in starts]
                    continue
                for pin in _matching(ends["output"], target):
                    self.into[self.net(pin)] += [_Edge(start, ns) for start in starts]
        ports = (port for port in module["ports"].values() if port["direction"] != "input")
        self.leaving = {bit for port in ports for bit in port["bits"]}
        before = {
            net: [self.net(edge.load) for edge in edges if edge.load is not None]
            for net, edges in self.into.items()
        }
        try:
            self.order = [*TopologicalSorter(before).static_order()]
        except CycleError as error:
            cells = sorted({self.driver[net].cell for net in error.args[1]})
            text = f"a loop of logic through {', '.join(cells)}; put a register into it"
            raise SynthesisError(text) from None

    def net(self, pin: _Pin) -> int:
        net: int = self.cells[pin.cell]["connections"][pin.port][pin.bit]
        return net

    def hop(self, load: _Pin, model: str) -> float:
        """Delay of the net that ends at a pin [ns]; wires inside a slice take no time."""
        net, nets = self.net(load), self.delays[model]
        if net not in self.driver:
            return 0.0
        driver, fanout = self.driver[net], len(self.loads[net]) + (net in self.leaving)
        source, target = (str(self.cells[pin.cell]["type"]) for pin in (driver, load))
        routed = next(ns for most, ns in nets.items() if not most or fanout <= int(most))
        is_table = source.startswith("LUT") or source == "INV"
        if source == "CARRY4" and driver[1:] == ("CO", 3):
            is_chain = target == "CARRY4" and load.port == "CI"
            return nets["carry"] if is_chain else routed + nets["carry_exit"]
        if (target == "CARRY4" and load.port == "S") or (target == "MUXF7" and load.port != "S"):
            rivals = [p for p in self.loads[net] if self.cells[p.cell]["type"] == target]
            alone = sum((p.port == "S") == (load.port == "S") for p in rivals) == 1
            return 0.0 if is_table and alone else routed + nets["table"]
        if source == "MUXF7" and target == "MUXF8" and load.port != "S":
            return 0.0
        if source == target == "DSP48A1" and (driver.port, load.port) == ("PCOUT", "PCIN"):
            return nets["cascade"]
        in_slice = is_table or source.startswith("MUXF") or (source, driver.port) == ("CARRY4", "O")
        if in_slice and target.startswith("FD") and load.port == "D" and fanout == 1:
            return 0.0
        return routed

    def longest(self, model: str) -> float:
        """Longest path with one statistic of nets [ns]; 0 without any."""
        arrival: dict[int, float] = {}

        def time(edge: _Edge) -> float | None:
            if edge.load is None:
                return edge.ns
            before = arrival.get(self.net(edge.load))
            return None if before is None else before + self.hop(edge.load, model) + edge.ns

        for net in self.order:
            times = [ns for edge in self.into[net] if (ns := time(edge)) is not None]
            if times:
                arrival[net] = max(times)
        skew = self.delays[model]["uncertainty"]
        ends = ((time(edge), skew if edge.load is not None else 0.0) for edge in self.ends)
        return max((ns + late for ns, late in ends if ns is not None), default=0.0)


def estimate_clock(netlist: Mapping[str, Any], top: str, grade: int) -> ClockEstimate | None:
    """Estimate the clock of a flat netlist of yosys, of primitives of Spartan-6, at a speed grade.

    Returns None if no register feeds a register.
    """
    graph = _Graph(netlist["modules"][top], grade)
    paths = [graph.longest(model) for model in _NETS]
    return ClockEstimate(*(int(10_000.0 / ns) / 10 for ns in paths)) if all(paths) else None
