"""Gowin: registers move into block RAM and multipliers, and what is not timed has no clock."""

import copy
import json

import pytest

from boresight.gateware.synthesis import routed as module
from boresight.gateware.synthesis.routed import Mapped, enclosed
from boresight.gateware.synthesis.targets import GW2A, TARGETS
from boresight.gateware.synthesis.tools import command, find_program, synthesise
from boresight.model.errors import InputError
from boresight.verbs.compile import compile, figures_of
from tests.support.router import REPORT, stand_in

DESIGN = """
module top(input clk, input go, input [8:0] at, input [8:0] to, input we, input signed [17:0] word,
           output reg [35:0] product, output reg [7:0] n);
    (* ram_style = "block", no_rw_check *) reg [17:0] memory [0:511];
    reg signed [17:0] out, behind, a, b;
    always @(posedge clk) begin
        if (we) memory[to] <= word;
        if (go) begin
            out <= memory[at]; behind <= out;
            a <= behind ^ {18{at[0]}}; b <= word; product <= a * b; n <= n + 1;
        end
    end
endmodule
"""


@pytest.fixture(scope="module")
def netlists():
    """Before and after, and how many flip-flops moved."""
    before = synthesise(DESIGN, top="top", command=GW2A.synthesis)
    after = copy.deepcopy(before)
    return before, after, GW2A.absorb(after, "top")


def cells(netlist, kind):
    return [c for c in netlist["modules"]["top"]["cells"].values() if c["type"].startswith(kind)]


def test_registers_move_into_block_ram_and_multipliers(netlists):
    _, netlist, moved = netlists
    (memory,), (multiplier,) = cells(netlist, "DPX9B"), cells(netlist, "MULT18X18")
    assert moved == 4 * 18 + 36 - 18 and len(cells(netlist, "DFF")) == 8
    assert memory["parameters"]["READ_MODE1"] == "1"
    assert {multiplier["parameters"][name] for name in ("AREG", "BREG", "OUT_REG")} == {"1"}
    enable = memory["connections"]["CEB"]
    assert enable == memory["connections"]["OCEB"] == multiplier["connections"]["CE"]
    assert multiplier["connections"]["CLK"] == memory["connections"]["CLKB"]
    constants = {"0", "1"} & {b for bits in multiplier["connections"].values() for b in bits}
    assert not constants


def test_a_memory_that_is_reset_keeps_its_register_outside(netlists):
    netlist = copy.deepcopy(netlists[0])
    (memory,) = cells(netlist, "DPX9B")
    memory["connections"]["RESETB"] = memory["connections"]["WREA"]
    GW2A.absorb(netlist, "top")
    assert memory["parameters"]["READ_MODE1"] == "0"


def test_the_clock_has_no_source_without_pins(netlists):
    top = enclosed(netlists[1], "top", GW2A)["modules"]["top"]
    assert not top["ports"] and not any("drive" in name for name in top["cells"])


@pytest.mark.parametrize(
    ("target", "part"), [("gw2a-18", "GW2A-LV18PG256C7/I6"), ("gw2a-18-9", "GW2A-LV18PG256C9/I8")]
)
def test_the_speed_grade_is_in_the_name_of_the_part(target, part):
    assert command(TARGETS[target], seed=1, clock_mhz=100)[:2] == ("--device", part)


def test_a_multiplier_that_is_not_timed_leaves_no_clock(netlists, tmp_path, monkeypatch):
    program = "nextpnr-himbaechel-gowin"
    stand_in(tmp_path, monkeypatch, program)(
        f"pathlib.Path('report.json').write_text({json.dumps(REPORT)!r})"
    )
    target = TARGETS["gw2a-18"]
    mapped = Mapped(target=target, netlist=netlists[1], used={"lut": 8}, version="")
    monkeypatch.setattr(module, "netlist_for", lambda *given, **options: mapped)
    routed = module.implement(DESIGN, "top", target, seeds=2)
    find_program.cache_clear()
    assert routed.clock_mhz is None and routed.untimed == ("MULT18X18",)
    assert "no delays of MULT18X18: no clock, other paths 66.6 MHz" in str(routed)
    figures = figures_of(routed)
    assert figures["clock_mhz"] is None and {*figures["seeds"].values()} == {None}


def test_a_clock_cannot_be_asked_for(tmp_path, monkeypatch):
    stand_in(tmp_path, monkeypatch, "nextpnr-himbaechel-gowin")("")
    with pytest.raises(InputError, match="clock: wanted a target whose multipliers nextpnr-"):
        compile("complementary", target="gw2a-18", route=True, clock=50, output=tmp_path / "out")
    find_program.cache_clear()
