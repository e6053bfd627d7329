"""A netlist without pins: a flip-flop at every port, so that a core of any width can be routed."""

from __future__ import annotations

import copy
from typing import Any

from boresight.gateware.synthesis.family import Family

__all__ = ["enclosed"]


def enclosed(
    netlist: dict[str, Any], top: str, family: Family, *, clock: str = "clk"
) -> dict[str, Any]:
    """The netlist with a flip-flop in place of every bit of its ports but the clock.

    Inputs come out of a shift register, outputs end in flip-flops: paths through ports are routed,
    and timed as if registers were beside the design.
    """
    out = copy.deepcopy(netlist)
    module = out["modules"][top]
    kind, parameters, c, d, q = family.flip_flop
    (bit,) = module["ports"][clock]["bits"]
    fresh = 1 + max(
        (
            b
            for x in (*module["cells"].values(), *module["ports"].values())
            for bits in x.get("connections", {"": x.get("bits", [])}).values()
            for b in bits
            if isinstance(b, int)
        ),
        default=1,
    )
    before: int | str = "0"
    for name, port in list(module["ports"].items()):
        if name == clock:
            continue
        for number, net in enumerate(port["bits"]):
            if not isinstance(net, int):
                continue
            if port["direction"] == "input":
                wires, before = {c: [bit], d: [before], q: [net]}, net
            else:
                wires, fresh = {c: [bit], d: [net], q: [fresh]}, fresh + 1
            module["cells"][f"$port${name}${number}"] = {
                "hide_name": 1,
                "type": kind,
                "parameters": dict(parameters),
                "attributes": {},
                "port_directions": {c: "input", d: "input", q: "output"},
                "connections": wires,
            }
        del module["ports"][name]
    return out
