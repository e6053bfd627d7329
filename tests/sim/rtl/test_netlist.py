"""Netlists after synthesis: every kind of memory against its source; a core against its model."""

from __future__ import annotations

import copy
import random
from functools import partial
from typing import Any

import numpy as np
import pytest

from boresight.gateware.synthesis.ecp5.family import ECP5
from boresight.gateware.synthesis.family import Family
from boresight.gateware.synthesis.routed import FamilyNetlist, netlist_of
from boresight.gateware.synthesis.spartan6.family import SPARTAN6
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.rtl import netlist as module
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.estimators import Leaky
from tests.support.netlists import differences

MEMORIES = """
module memories (
    input clk, input [1:0] en, input [1:0] we, input [3:0] lanes, input [12:0] a, b,
    input [35:0] d, e, output reg [17:0] p, q, output reg [31:0] r, output reg [3:0] s,
    output reg [8:0] t, output reg [35:0] u
);
    // Two ports of 18 bits that read and write: the words before.
    reg [17:0] both [0:1023];
    always @(posedge clk) if (en[0]) begin
        p <= both[a[9:0]];
        if (we[0]) both[a[9:0]] <= d[17:0];
    end
    always @(posedge clk) if (en[1]) begin
        q <= both[b[9:0]];
        if (we[1]) both[b[9:0]] <= e[17:0];
    end
    // A half block, 32 bits, bytes written apart.
    reg [31:0] bytes [0:255];
    always @(posedge clk) begin
        r <= bytes[b[7:0]];
        for (k = 0; k < 4; k = k + 1)
            if (we[0] & lanes[k]) bytes[a[7:0]][8*k +: 8] <= d[8*k +: 8];
    end
    // A ROM, narrow and deep.
    reg [3:0] rom [0:8191];
    always @(posedge clk) if (en[0]) s <= rom[a];
    // One port of 9 bits that shows what it writes.
    reg [8:0] first [0:2047];
    always @(posedge clk) if (en[0]) begin
        if (we[1]) first[a[10:0]] <= d[8:0];
        t <= we[1] ? d[8:0] : first[a[10:0]];
    end
    // 36 bits with parity bits, written at one port.
    reg [35:0] wide [0:511];
    always @(posedge clk) begin
        if (we[0]) wide[a[8:0]] <= d;
        u <= wide[b[8:0]];
    end
    integer k;
    initial begin
        $readmemh("both.hex", both);
        $readmemh("bytes.hex", bytes);
        $readmemh("rom.hex", rom);
        $readmemh("first.hex", first);
        $readmemh("wide.hex", wide);
        {p, q, r, s, t, u} = 0;
    end
endmodule
"""

_SHAPES = {"both": (1024, 18), "bytes": (256, 32), "rom": (8192, 4), "first": (2048, 9)}
_SHAPES["wide"] = (512, 36)
_DRAW = random.Random(5)
CONTENTS = {
    f"{name}.hex": "".join(f"{_DRAW.getrandbits(width):x}\n" for _ in range(words))
    for name, (words, width) in _SHAPES.items()
}

BENCH = """
module bench (input clk, input rst);
    integer cycle = 0, differ = 0;
    reg [1:0] en = 0, we = 0;
    reg [3:0] lanes = 0;
    reg [12:0] a = 0, b = 1;
    reg [35:0] d = 0, e = 0;
    wire [116:0] x, y;
    source one (clk, en, we, lanes, a, b, d, e, x[116:99], x[98:81], x[80:49], x[48:45],
                x[44:36], x[35:0]);
    memories two (clk, en, we, lanes, a, b, d, e, y[116:99], y[98:81], y[80:49], y[48:45],
                  y[44:36], y[35:0]);
    reg [12:0] near;
    always @(posedge clk) begin
        if (x !== y && cycle > 4) differ <= differ + 1;
        cycle <= cycle + 1;
        {en, we, lanes} <= $random;
        near = {$random} % 8191;
        a <= near;
        // Often the same place or beside it; never the same one written by both.
        b <= cycle % 3 == 0 ? near ^ 1 : cycle % 3 == 1 ? near ^ 8 : $random ^ {12'd0, ~near[0]};
        if (cycle % 5 == 0) begin
            b <= near;
            we[1] <= 0;
        end
        d <= {$random, $random};
        e <= {$random, $random};
        if (cycle == 20000) begin
            $display("differ %0d", differ);
            $finish;
        end
    end
endmodule
"""


@pytest.mark.parametrize(
    ("family", "kinds"),
    [
        pytest.param(SPARTAN6, {("RAMB16BWER", ""), ("RAMB8BWER", "SDP")}, id="spartan6"),
        pytest.param(ECP5, {("DP16KD", "")}, id="ecp5", marks=pytest.mark.soak),
    ],
)
def test_every_kind_of_memory(family: Family, kinds: set[tuple[str, str]]) -> None:
    """Block RAM answers as its source does; a wrong row of contents is noticed."""
    # ECP5 has no memory whose two ports read what was there before the other one writes.
    source = MEMORIES if family is SPARTAN6 else MEMORIES.replace("if (we[1]) both", "if (0) both")
    files = {"memories.v": source, **CONTENTS}
    netlist = netlist_of(files, "memories", family).synthesis.netlist
    cells = netlist["modules"]["memories"]["cells"]
    found = {(c["type"], c["parameters"].get("RAM_MODE", "").strip()) for c in cells.values()}
    assert kinds <= found

    def differ() -> int:
        return differences(
            BENCH, source, netlist, top="memories", family=family.name, files=CONTENTS
        )

    assert differ() == 0
    contents = next(c["parameters"] for name, c in cells.items() if name.startswith("rom."))
    (row,) = {"INIT_05", "INITVAL_05"} & contents.keys()
    contents[row] = contents[row].translate({48: 49, 49: 48})
    assert differ() > 0


@pytest.mark.parametrize(
    ("target", "config", "table"),
    [
        ("xc6slx9", "small", "LUT6"),
        pytest.param("ecp5-25k", "small-d10", "LUT4", marks=pytest.mark.soak),
        pytest.param("ice40-up5k", "small", "SB_LUT4", marks=pytest.mark.soak),
        pytest.param("lifcl-17", "small", "LUT4", marks=pytest.mark.soak),
        pytest.param("gw2a-18", "small", "LUT4", marks=pytest.mark.soak),
    ],
)
def test_a_core_after_synthesis(
    target: str, config: str, table: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The netlist's words and cycles are those of the model; one wrong LUT is noticed."""
    level_build = Build(Leaky(), word=18, target=target, config=config)
    records = np.random.default_rng(3).uniform(-0.9, 0.9, (40, len(Leaky().inputs)))
    wanted = make_level("fixed", level_build).run(records)
    for faulty in (False, True):
        level = make_level("netlist", level_build)
        if faulty:
            monkeypatch.setattr(module, "netlist_of", partial(_with_a_wrong_lut, table))
        try:
            run = level.run(records)
        except SimulationFailed:  # hangs
            assert faulty
            continue
        same = run.words.tolist() == wanted.words.tolist() and not run.fault
        assert same is not faulty


def _with_a_wrong_lut(table: str, *arguments: Any, **options: Any) -> FamilyNetlist:
    result = copy.deepcopy(netlist_of(*arguments, **options))
    cells = result.synthesis.netlist["modules"]["core"]["cells"].values()
    lut = [c for c in cells if c["type"] == table][60]
    (content,) = {"INIT", "LUT_INIT"} & lut["parameters"].keys()
    table_bits = lut["parameters"][content]
    if set(table_bits) <= {"0", "1"}:
        inverted = table_bits.translate({48: 49, 49: 48})
    else:  # Lattice's hexadecimal digits
        inverted = f"0x{int(table_bits, 16) ^ 0xFFFF:04X}"
    lut["parameters"][content] = inverted
    return result
