"""A netlist without pins: a flip-flop at every port, so that a core of any width can be routed."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from itertools import count
from typing import Any

from boresight.gateware.synthesis.family import Family

__all__ = ["enclosed"]


def enclosed(
    netlist: dict[str, Any], top: str, family: Family, *, clock: str = "clk"
) -> dict[str, Any]:
    """The netlist with a flip-flop in place of every bit of its ports but the clock.

    Inputs come out of a shift register, outputs end in flip-flops: paths through ports are routed,
    and timed as if registers were beside the design. What drives the clock, and constants, is as
    `Family.drivers` says.
    """
    out = copy.deepcopy(netlist)
    module = out["modules"][top]
    cells, ports = module["cells"], module["ports"]
    kind, parameters, c, d, q = family.flip_flop
    (clock_net,) = ports[clock]["bits"]
    used = (
        bit
        for x in (*cells.values(), *ports.values())
        for bits in x.get("connections", {"": x.get("bits", [])}).values()
        for bit in bits
        if isinstance(bit, int)
    )
    fresh = count(1 + max(used, default=1))

    def drive(signal: str, net: int) -> int:
        if (driver := family.drivers[signal]) is not None:
            cell_type, settings, output = driver
            cells[f"$drive${signal}"] = _cell(cell_type, settings, {}, {output: net})
        return net

    before: int | str = drive("0", next(fresh)) if "0" in family.drivers else "0"
    if "clk" in family.drivers:
        drive("clk", clock_net)
        del ports[clock]
    for name, port in list(ports.items()):
        if name == clock:
            continue
        for number, net in enumerate(port["bits"]):
            if not isinstance(net, int):
                continue
            entering = port["direction"] == "input"
            inputs = {c: clock_net, d: before if entering else net}
            output = {q: net if entering else next(fresh)}
            before = net if entering else before
            cells[f"$port${name}${number}"] = _cell(kind, parameters, inputs, output)
        del ports[name]
    return out


def _cell(
    kind: str,
    parameters: Mapping[str, str],
    inputs: Mapping[str, int | str],
    outputs: Mapping[str, int],
) -> dict[str, Any]:
    return {
        "hide_name": 1,
        "type": kind,
        "parameters": dict(parameters),
        "attributes": {},
        "port_directions": {**dict.fromkeys(inputs, "input"), **dict.fromkeys(outputs, "output")},
        "connections": {port: [net] for port, net in {**inputs, **outputs}.items()},
    }
