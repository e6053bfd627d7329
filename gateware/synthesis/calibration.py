"""How far the clock estimate's method is from routed clocks.

No open tool routes a Spartan-6, so its clock is estimated: the netlist, delays of cells, and for
each net the median or the upper quartile of nets with its fan-out on paths that limit the clock of
other designs. Here the same is done to ECP5, which nextpnr routes, with ECP5's delays: each design
is estimated with the nets of all the others, and compared with its routed clock.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.gateware.synthesis.ecp5.primitives import PRIMITIVES, delay_table
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.harness import enclosed
from boresight.gateware.synthesis.netlist import Netlist
from boresight.gateware.synthesis.routed import Routed
from boresight.gateware.synthesis.spartan6.delays import NET_CLASSES, NET_MODELS, fanout_key
from boresight.gateware.synthesis.timing import analyse

__all__ = ["Estimated", "estimated"]


@dataclass(frozen=True)
class Estimated:
    """A routed design and its estimates.

    Attributes
    ----------
    design : str
    routed_mhz : list of float
        Clock of each seed.
    estimates_mhz : mapping
        Estimated clock, by net model.
    errors : mapping
        Estimate less the clock of the slowest seed, as a part of that, by net model.
    """

    design: str
    routed_mhz: list[float]
    estimates_mhz: Mapping[str, float]
    errors: Mapping[str, float]


def estimated(designs: Mapping[str, Routed], top: str) -> list[Estimated]:
    """Estimate each design with the nets of the others.

    Parameters
    ----------
    designs : mapping
        Designs by name, routed on ECP5, two or more.
    top : str
        Their module.
    """
    netlists = {
        name: enclosed(routed.mapped.netlist, top, routed.mapped.target.family)
        for name, routed in designs.items()
    }
    nets = {
        name: list(_nets_of_paths(netlists[name], top, routed)) for name, routed in designs.items()
    }
    out = []
    for name, routed in designs.items():
        graph = build_graph(Netlist.from_json(netlists[name], top=top), PRIMITIVES)
        pool = [net for other, of_other in nets.items() if other != name for net in of_other]
        mhz = {
            model: analyse(graph, table=delay_table(_by_class(pool, model), name=model)).fmax_mhz
            for model in NET_MODELS
        }
        worst = routed.clock_mhz
        assert worst is not None
        estimates = {model: clock for model, clock in mhz.items() if clock is not None}
        out.append(
            Estimated(
                name,
                [run.clock_mhz or 0.0 for run in routed.runs],
                estimates,
                {model: round(clock / worst - 1.0, 3) for model, clock in estimates.items()},
            )
        )
    return out


def _nets_of_paths(
    netlist: Mapping[str, Any], top: str, routed: Routed
) -> Iterator[tuple[int, float]]:
    """Fan-out and delay of the routed nets on the paths that limit the clock, of all seeds."""
    bits = {
        name if len(net["bits"]) == 1 else f"{name}[{k + net.get('offset', 0)}]": bit
        for name, net in netlist["modules"][top]["netnames"].items()
        for k, bit in enumerate(net["bits"])
    }
    loads = Netlist.from_json(netlist, top=top)
    for run in routed.runs:
        for step in run.path:
            if step.kind == "routing" and step.ns > 0.0 and step.net in bits:
                yield loads.fanout(bits[step.net]), step.ns


def _by_class(nets: Sequence[tuple[int, float]], model: str) -> dict[str, float]:
    """Delay by class of fan-out; none is faster than that of fewer loads."""
    delays, floor = {}, 0.0
    for name in NET_CLASSES:
        times = sorted(ns for loads, ns in nets if fanout_key(loads) == name)
        if len(times) > 1:
            _, median, upper = statistics.quantiles(times, n=4, method="inclusive")
            floor = max(floor, median if model == "median" else upper)
        delays[name] = floor
    return delays
