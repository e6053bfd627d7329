"""The estimate's method on ECP5: each design with the nets of the others."""

import pytest

from boresight.gateware.synthesis.calibration import estimated
from boresight.gateware.synthesis.ecp5.primitives import delay_table
from boresight.gateware.synthesis.nextpnr import Run, Step
from boresight.gateware.synthesis.routed import Mapped, Routed
from boresight.gateware.synthesis.spartan6.delays import NET_CLASSES
from boresight.gateware.synthesis.targets import TARGETS

CELLS = delay_table(dict.fromkeys(NET_CLASSES, 0.0), name="none")


def cell(kind, outputs=("Z", "Q"), parameters=None, **wires):
    return {
        "type": kind,
        "parameters": parameters or {},
        "attributes": {},
        "port_directions": {p: "output" if p in outputs else "input" for p in wires},
        "connections": {p: [bit] for p, bit in wires.items()},
    }


def routed(tables: int, clocks: dict[float, list[float]]) -> Routed:
    """A flip-flop, tables behind it and a flip-flop; delays of the nets between, for each clock."""
    cells = {f"t{k}": cell("LUT4", A=10 + k, Z=11 + k) for k in range(tables)}
    cells["first"] = cell("TRELLIS_FF", CLK=2, DI=3, Q=10)
    cells["last"] = cell("TRELLIS_FF", CLK=2, DI=10 + tables, Q=4)
    names = {f"n[{k}]": [10 + k] for k in range(tables + 1)}
    module = {
        "attributes": {"top": "1"},
        "ports": {
            name: {"direction": direction, "bits": [bit]}
            for name, direction, bit in (("clk", "input", 2), ("i", "input", 3), ("o", "output", 4))
        },
        "cells": cells,
        "netnames": {name: {"bits": bits} for name, bits in names.items()},
    }
    mapped = Mapped(
        target=TARGETS["ecp5-25k"],
        netlist={"modules": {"top": module}},
        used={},
        inside=0,
        version="",
        command="",
    )
    runs = tuple(
        Run(
            seed=seed,
            clock_mhz=mhz,
            path=tuple(
                Step(kind="routing", ns=ns, start="", end="", net=f"n[{k}]")
                for k, ns in enumerate(delays)
            ),
            files={},
        )
        for seed, (mhz, delays) in enumerate(clocks.items(), 1)
    )
    return Routed(mapped=mapped, runs=runs, version="", command="")


def test_each_design_has_the_nets_of_the_others() -> None:
    short = routed(2, {200.0: [1.0, 1.0, 0.0], 160.0: [2.0, 2.0, 0.0]})
    long = routed(4, {80.0: [0.5, 0.5, 0.5, 0.5, 0.0]})
    (one, two) = estimated({"short": short, "long": long}, "top")
    assert (one.design, one.routed_mhz) == ("short", [200.0, 160.0])

    def mhz(tables: int, net_ns: float) -> float:
        cells = CELLS["ff_clk_q"].ns + tables * CELLS["lut"].ns + CELLS["ff_d_lut"].ns
        return 1000.0 / (cells + tables * net_ns)

    assert one.estimates_mhz == pytest.approx(dict.fromkeys(("median", "p75"), mhz(2, 0.5)), 1e-3)
    assert two.estimates_mhz["median"] == pytest.approx(mhz(4, 1.5), 1e-3)
    assert two.estimates_mhz["p75"] == pytest.approx(mhz(4, 2.0), 1e-3)
    # Against the slowest seed.
    assert one.errors["median"] == pytest.approx(mhz(2, 0.5) / 160.0 - 1.0, abs=1e-3)
    assert two.errors["p75"] == pytest.approx(mhz(4, 2.0) / 80.0 - 1.0, abs=1e-3)
