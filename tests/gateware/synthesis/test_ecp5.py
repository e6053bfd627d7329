"""Flip-flops that move into multipliers and memories: the netlist computes the same.

The netlist is run cell by cell before and after, by meanings written here after the vendor's
library guide: registers of MULT18X18D, and output registers of DP16KD, which need the enable of the
port and their own.
"""

import copy
import random

import pytest

from boresight.gateware.engine.leading import LeadingSignCount
from boresight.gateware.synthesis.ecp5.family import ECP5
from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import synthesise
from boresight.gateware.verilog import to_verilog
from boresight.model.words.fixed import Arithmetic

#: Multiplier and memory with registers around them, as yosys leaves them.
DESIGN = """
module top(input clk, input [1:0] stop, input [8:0] at, input [8:0] to, input we, input [35:0] word,
           output reg [35:0] product, output [35:0] read);
    wire go = ~&stop;
    (* ram_style = "block" *) reg [35:0] memory [0:511];
    reg [35:0] out, behind;
    reg signed [17:0] a, b;
    always @(posedge clk) begin
        if (we) memory[to] <= word;
        if (go) begin
            out <= memory[at];
            behind <= out;
            a <= behind[17:0] ^ {18{at[0]}};
            b <= behind[35:18];
            product <= a * b;
        end
    end
    assign read = behind;
endmodule
"""
PINS = {"stop": 2, "at": 9, "to": 9, "we": 1, "word": 36}


class Machine:
    """A netlist of LUT4, TRELLIS_FF, MULT18X18D and a DP16KD of 36 bits, all registers 0."""

    def __init__(self, netlist):
        self.top = netlist["modules"]["top"]
        self.cells = self.top["cells"]
        self.driver = {
            bit: (name, port)
            for name, cell in self.cells.items()
            for port, (bit, *_) in cell["connections"].items()
            if cell["port_directions"][port] == "output"
        }
        self.state = {}
        self.words = {}

    def value(self, bit):
        """Value of a net in this cycle."""
        if bit in ("0", "1", "x"):
            return int(bit == "1")
        if bit not in self.now:
            name, port = self.driver[bit]
            cell = self.cells[name]
            if cell["type"] == "LUT4":
                place = sum(self.pin(cell, p) << k for k, p in enumerate("ABCD"))
                self.now[bit] = int(cell["parameters"]["INIT"], 2) >> place & 1
            elif cell["type"] == "TRELLIS_FF":
                self.now[bit] = self.state.get(name, 0)
            else:
                out = (
                    self.product(name, cell)
                    if cell["type"] == "MULT18X18D"
                    else self.read(name, cell)
                )
                number = int(port[3:] if port.startswith("DO") else port[1:])
                self.now[bit] = out >> number + 18 * port.startswith("DOA") & 1
        return self.now[bit]

    def pin(self, cell, port):
        return self.value(cell["connections"].get(port, ["0"])[0])

    def word(self, cell, port, width=18):
        return sum(self.pin(cell, f"{port}{k}") << k for k in range(width))

    def uses(self, cell, register):
        return cell["parameters"].get(f"REG_{register}_CLK", "NONE") != "NONE"

    def factor(self, name, cell, port):
        raw = self.word(cell, port)
        held = self.state.get((name, port), 0)
        word = held if self.uses(cell, f"INPUT{port}") else raw
        return word - (word >> 17 << 18)

    def product(self, name, cell, *, made=False):
        if self.uses(cell, "OUTPUT") and not made:
            return self.state.get((name, "P"), 0)
        return self.factor(name, cell, "A") * self.factor(name, cell, "B") % (1 << 36)

    def read(self, name, cell):
        held = cell["parameters"]["REGMODE_B"] == "OUTREG"
        assert (cell["parameters"]["REGMODE_A"] == "OUTREG") == held
        return self.state.get((name, "later" if held else "now"), 0)

    def step(self, **inputs):
        """The outputs of a cycle, and on to the next one."""
        self.now = {
            bit: value >> k & 1
            for port, value in inputs.items()
            for k, bit in enumerate(self.top["ports"][port]["bits"])
        }
        outputs = [
            [self.value(bit) for bit in self.top["ports"][port]["bits"]]
            for port in ("product", "read")
        ]
        after = {}
        for name, cell in self.cells.items():
            if cell["type"] == "TRELLIS_FF":
                mux = cell["parameters"]["CEMUX"].strip()
                enabled = mux == "1" or self.pin(cell, "CE") == (mux == "CE")
                assert not self.pin(cell, "LSR")
                if enabled:
                    after[name] = self.pin(cell, "DI")
            elif cell["type"] == "MULT18X18D" and self.pin(cell, "CE0"):
                after |= {(name, port): self.word(cell, port) for port in "AB"}
                after[name, "P"] = self.product(name, cell, made=True)
            elif cell["type"] == "DP16KD":
                if self.pin(cell, "CEB"):
                    # A pair of enables: the register must not depend on which of them counts.
                    assert self.pin(cell, "OCEA") == self.pin(cell, "OCEB") or "NOREG" in str(
                        cell["parameters"]
                    )
                    if self.pin(cell, "OCEB"):
                        after[name, "later"] = self.state.get((name, "now"), 0)
                    after[name, "now"] = self.words.get(self.word(cell, "ADB", 14) >> 5, 0)
                if self.pin(cell, "CEA") and self.pin(cell, "WEA") and self.pin(cell, "ADA0"):
                    word = self.word(cell, "DIA") | self.word(cell, "DIB") << 18
                    self.words[self.word(cell, "ADA", 14) >> 5] = word
        self.state |= after
        return outputs


@pytest.fixture(scope="module")
def netlists():
    """Before and after, and how many flip-flops moved."""
    command = ECP5.synthesis.replace("*operands*/m:*", "top/m:*")
    before = synthesise(DESIGN, top="top", command=command).netlist
    after = copy.deepcopy(before)
    return before, after, ECP5.absorb(after, "top")


def cells(netlist, kind):
    return [c for c in netlist["modules"]["top"]["cells"].values() if c["type"] == kind]


def test_every_register_is_used(netlists):
    before, after, moved = netlists
    (memory,), (multiplier,) = cells(after, "DP16KD"), cells(after, "MULT18X18D")
    assert memory["parameters"]["REGMODE_A"] == memory["parameters"]["REGMODE_B"] == "OUTREG"
    for register in ("INPUTA", "INPUTB", "OUTPUT"):
        assert multiplier["parameters"][f"REG_{register}_CLK"] == "CLK0"
    assert not cells(after, "TRELLIS_FF") and moved == len(cells(before, "TRELLIS_FF")) == 108
    enables = {str(memory["connections"][port]) for port in ("CEB", "OCEA", "OCEB")}
    assert enables == {str(multiplier["connections"]["CE0"])}


def test_it_computes_the_same(netlists):
    draw = random.Random(1)
    machines = [Machine(netlist) for netlist in netlists[:2]]
    products = set()
    for _ in range(300):
        inputs = {name: draw.getrandbits(width) for name, width in PINS.items()}
        inputs |= {"at": 2 * draw.randrange(2) + 1, "to": 2 * draw.randrange(2)}
        inputs["at"] = draw.randrange(4)
        inputs["to"] = (inputs["at"] + draw.randrange(1, 4)) % 4  # not the word that is read
        gold, gate = (machine.step(**inputs) for machine in machines)
        assert gold == gate
        products.add(str(gold))
    assert len(products) > 100


@pytest.mark.parametrize(
    ("changed", "left"),
    [
        ({"REGSET": "SET"}, "starts at 1"),
        ({"CEMUX": "1 "}, "another enable"),
        ({"CLKMUX": "INV"}, "the falling edge"),
    ],
)
def test_a_register_that_differs_stays(netlists, changed, left):
    netlist = copy.deepcopy(netlists[0])
    module = netlist["modules"]["top"]
    (memory,) = cells(netlist, "DP16KD")
    read = memory["connections"]["DOB3"][0]
    (beside,) = (c for c in cells(netlist, "TRELLIS_FF") if c["connections"]["DI"] == [read])
    beside["parameters"] |= changed
    ECP5.absorb(netlist, "top")
    assert memory["parameters"]["REGMODE_B"] == "NOREG", left
    assert len([c for c in module["cells"].values() if c["type"] == "TRELLIS_FF"]) == 36


def test_an_output_that_is_read_before_its_register_stays(netlists):
    netlist = copy.deepcopy(netlists[0])
    (memory,) = cells(netlist, "DP16KD")
    netlist["modules"]["top"]["ports"]["early"] = {
        "direction": "output",
        "bits": memory["connections"]["DOA1"],
    }
    ECP5.absorb(netlist, "top")
    assert memory["parameters"]["REGMODE_A"] == "NOREG"


@pytest.mark.parametrize("free", [False, True])
def test_an_enable_that_is_free_reaches_every_register_directly(free):
    dut = LeadingSignCount(arithmetic=Arithmetic(18), free=free)
    netlist = netlist_for(to_verilog(dut, "top", instances=False), "top", TARGETS["ecp5-25k"])
    cells = netlist.netlist["modules"]["top"]["cells"].values()
    enables = {c["connections"]["CE"][0] for c in cells if c["type"] == "TRELLIS_FF"}
    enable = netlist.netlist["modules"]["top"]["ports"]["en"]["bits"][0]
    assert enable in enables and len(enables) == (1 if free else 2)
