"""Hand-made netlists for the synthesis tests."""

import pytest

#: Output ports of the primitives used in tests; every other port is an input.
OUTPUTS = {
    "O",
    "O5",
    "O6",
    "Q",
    "Q15",
    "Q31",
    "CO",
    "P",
    "PCOUT",
    "M",
    "BCOUT",
    "CARRYOUT",
    "DOA",
    "DOB",
    "DOPA",
    "DOPB",
    "DOADO",
    "DPO",
    "SPO",
    "DOC",
    "DOD",
}


class Tiny:
    """Collects cells with named nets and gives them as yosys JSON.

    A port is one net name or a list of them; "0", "1" and "x" are constants. Nets that nothing
    drives stand for ports of the module.
    """

    def __init__(self):
        self.cells = {}
        self.numbers = {}
        self.exits = []

    def bit(self, net):
        if net in ("0", "1", "x"):
            return net
        return self.numbers.setdefault(net, len(self.numbers) + 2)

    def add(self, type_, name, params=None, src="", **ports):
        nets = {p: v if isinstance(v, list) else [v] for p, v in ports.items()}
        self.cells[name] = {
            "type": type_,
            "parameters": params or {},
            "attributes": {"src": src} if src else {},
            "port_directions": {p: "output" if p in OUTPUTS else "input" for p in nets},
            "connections": {p: [self.bit(n) for n in v] for p, v in nets.items()},
        }
        return self

    def ff(self, d, q, **extra):
        """A flip-flop named after its output."""
        return self.add(
            "FDRE", q, C="clk", CE=extra.pop("CE", "1"), D=d, Q=q, R=extra.pop("R", "0"), **extra
        )

    def lut(self, output, *inputs):
        pins = {f"I{k}": net for k, net in enumerate(inputs)}
        return self.add(f"LUT{len(inputs)}", f"lut_{output}", O=output, **pins)

    def leave(self, *nets):
        """Let nets leave through an output port."""
        self.exits += nets
        return self

    def json(self):
        ports = {
            f"out{k}": {"direction": "output", "bits": [self.bit(net)]}
            for k, net in enumerate(self.exits)
        }
        names = {net: {"hide_name": 0, "bits": [n]} for net, n in self.numbers.items()}
        top = {
            "attributes": {"top": "1".rjust(32, "0")},
            "ports": ports,
            "cells": self.cells,
            "netnames": names,
        }
        return {"creator": "hand", "modules": {"tiny": top}}

    def netlist(self):
        from boresight.gateware.synthesis.netlist import Netlist

        return Netlist.from_json(self.json())


@pytest.fixture
def tiny():
    return Tiny()
