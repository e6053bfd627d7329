"""DSP48A1: every choice of registers against sums by hand from the -2 median table.

A path from a flip-flop costs .525 and its net .553 before the slice; a path to a flip-flop costs
its net .553 and D setup .114 behind it; both end with .135 of clock uncertainty.
"""

import pytest

from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import NetlistError
from boresight.gateware.synthesis.timing import analyse

NONE = dict.fromkeys(
    ("A0REG", "A1REG", "B0REG", "B1REG", "CREG", "DREG", "MREG", "PREG", "OPMODEREG", "CARRYINREG"),
    0,
)
INTO, OUT, END = 0.525 + 0.553, 0.553 + 0.114, 0.135
PRODUCT = "10000000"  # OPMODE, bit 0 first: X = M
PRODUCT_ADD_C = "10110000"  # X = M, Z = C
PRODUCT_ADD_PCIN = "10100000"
ACCUMULATE = "10010000"
CONCAT = "11000000"  # X = D:A:B


def groups(net):
    return {g.name: g.worst_ns for g in analyse(net).groups}


def insides(net):
    return {
        (p.start, p.end): p.delay_ns
        for p in analyse(net, top=99).ends
        if p.group == "DSP48A1 inside"
    }


def dsp(tiny, opmode=PRODUCT, *, regs="", pins=None, out="P"):
    """One slice between flip-flop ``q`` and flip-flop ``z``; ``regs`` lists registers in use."""
    params = {**NONE, **dict.fromkeys(regs.split(), 1)}
    mode = {} if opmode is None else {"OPMODE": list(opmode)}
    tiny.ff("in", "q")
    tiny.add("DSP48A1", "d", params, CLK="clk", **mode, **(pins or {}), **{out: ["0", "y"]})
    return tiny.ff("y", "z").netlist()


@pytest.mark.parametrize(
    ("opmode", "pin", "through"),
    [
        (PRODUCT, "A", 3.60),
        (PRODUCT, "B", 3.60),
        (PRODUCT_ADD_C, "C", 2.60),
        (PRODUCT_ADD_PCIN, "PCIN", 2.60),
        (CONCAT, "A", 2.60),
        (CONCAT, "B", 2.60),
        (CONCAT, "D", 2.60),
    ],
)
@pytest.mark.parametrize("out", ["P", "PCOUT"])
def test_pin_to_output_without_registers(tiny, opmode, pin, through, out):
    net = dsp(tiny, opmode, pins={pin: ["0", "q"]}, out=out)
    assert groups(net) == {"FDRE.D": pytest.approx(INTO + through + OUT + END)}


@pytest.mark.parametrize(
    ("opmode", "regs", "pin", "setup"),
    [
        (PRODUCT, "A0REG", "A", 0.18),
        (PRODUCT, "A1REG", "A", 0.18),
        (PRODUCT, "B0REG", "B", 0.18),
        (PRODUCT, "B1REG", "B", 0.18),
        (PRODUCT_ADD_C, "CREG", "C", 0.13),
        (CONCAT, "DREG", "D", 0.18),
        (PRODUCT, "MREG", "A", 2.90),
        (PRODUCT, "MREG", "B", 2.90),
        (PRODUCT, "PREG", "A", 3.40),
        (PRODUCT, "PREG", "B", 3.40),
        (PRODUCT_ADD_C, "PREG", "C", 2.40),
        (PRODUCT_ADD_PCIN, "PREG", "PCIN", 2.40),
        (CONCAT, "PREG", "A", 2.40),
        (CONCAT, "PREG", "D", 2.40),
        (PRODUCT, "MREG PREG", "A", 2.90),
        (PRODUCT_ADD_C, "MREG PREG", "C", 2.40),
    ],
)
def test_pin_to_first_register(tiny, opmode, regs, pin, setup):
    net = dsp(tiny, opmode, regs=regs, pins={pin: ["0", "q"]})
    assert groups(net)[f"DSP48A1.{pin}"] == pytest.approx(INTO + setup + END)


@pytest.mark.parametrize(
    ("opmode", "regs", "clock_to_p"),
    [
        (PRODUCT, "PREG", 1.40),
        (PRODUCT, "MREG", 2.20),
        (PRODUCT, "A1REG", 3.90),
        (PRODUCT, "A0REG", 3.90),
        (PRODUCT, "B0REG", 3.90),
        (PRODUCT, "B1REG", 3.90),
        ("00110000", "CREG", 2.90),
        (CONCAT, "DREG", 2.90),
        (PRODUCT, "A1REG MREG", 2.20),
        (PRODUCT, "A1REG B1REG MREG PREG CREG", 1.40),
    ],
)
def test_register_to_output(tiny, opmode, regs, clock_to_p):
    net = dsp(tiny, opmode, regs=regs)
    assert groups(net)["FDRE.D"] == pytest.approx(clock_to_p + OUT + END)


@pytest.mark.parametrize(
    ("opmode", "regs", "arcs"),
    [
        (PRODUCT, "A1REG B1REG MREG", {("A1REG", "MREG"): 3.003, ("B1REG", "MREG"): 3.003}),
        (PRODUCT, "A0REG MREG", {("A0REG", "MREG"): 3.003}),
        (PRODUCT, "A0REG A1REG MREG", {("A1REG", "MREG"): 3.003}),
        (PRODUCT, "A1REG PREG", {("A1REG", "PREG"): 3.90}),
        (PRODUCT, "MREG PREG", {("MREG", "PREG"): 2.30}),
        (PRODUCT_ADD_C, "CREG PREG", {("CREG", "PREG"): 2.625}),
        (ACCUMULATE, "MREG PREG", {("MREG", "PREG"): 2.30, ("PREG", "PREG"): 2.625}),
        ("01000000", "PREG", {("PREG", "PREG"): 2.625}),
        (CONCAT, "A1REG DREG PREG", {("A1REG", "PREG"): 2.625, ("DREG", "PREG"): 2.625}),
        (PRODUCT, "CREG PREG", {}),  # C is not selected
        ("00110000", "A1REG MREG CREG PREG", {("CREG", "PREG"): 2.625}),  # nor is M here
    ],
)
def test_register_to_register(tiny, opmode, regs, arcs):
    """No clock uncertainty inside a slice."""
    got = insides(dsp(tiny, opmode, regs=regs))
    assert got == {(f"d.{a}", f"d.{b}"): pytest.approx(ns) for (a, b), ns in arcs.items()}


def test_unselected_inputs_have_no_path(tiny):
    net = dsp(tiny, PRODUCT, regs="PREG", pins={"C": ["q"], "PCIN": ["q"], "D": ["q"]})
    assert list(groups(net)) == ["FDRE.D"]


def test_changing_opmode_allows_every_input(tiny):
    mode = ["m0", "m1", "m2", "m3", "0", "0", "0", "0"]
    pins = {p: ["q"] for p in ("A", "B", "C", "PCIN")}
    got = groups(dsp(tiny, mode, regs="PREG", pins=pins))
    assert set(got) == {"FDRE.D", "DSP48A1 inside", *(f"DSP48A1.{p}" for p in pins)}


@pytest.mark.parametrize(("regs", "setup"), [("PREG", 2.40), ("PREG OPMODEREG", 0.30)])
@pytest.mark.parametrize("index", [0, 1, 2, 3, 5, 7])
def test_opmode_pin(tiny, regs, setup, index):
    mode = list("10000000")
    mode[index] = "q"
    got = groups(dsp(tiny, mode, regs=regs))["DSP48A1.OPMODE"]
    assert got == pytest.approx(0.525 + 0.553 + setup + END)


def test_opmode_pin_to_output(tiny):
    net = dsp(tiny, [*"1011000", "q"])
    assert groups(net)["FDRE.D"] == pytest.approx(INTO + 2.60 + OUT + END)


def test_opmode_register(tiny):
    net = dsp(tiny, [*"1000000", "q"], regs="PREG OPMODEREG")
    assert insides(net) == {("d.OPMODEREG", "d.PREG"): pytest.approx(2.625)}


@pytest.mark.parametrize(("regs", "setup"), [("PREG", 2.40), ("PREG CARRYINREG", 0.30)])
def test_carry_in_pin(tiny, regs, setup):
    tiny.ff("in", "q")
    params = {**NONE, **dict.fromkeys(regs.split(), 1), "CARRYINSEL": "CARRYIN"}
    tiny.add("DSP48A1", "d", params, OPMODE=list(PRODUCT), CARRYIN="q", CLK="clk")
    got = groups(tiny.netlist())["DSP48A1.CARRYIN"]
    assert got == pytest.approx(INTO + setup + END)


def test_carry_in_pin_not_selected(tiny):
    assert "DSP48A1.CARRYIN" not in groups(dsp(tiny, regs="PREG", pins={"CARRYIN": "q"}))


@pytest.mark.parametrize(
    ("regs", "pin"),
    [
        ("A0REG", "CEA"),
        ("A1REG", "RSTA"),
        ("B1REG", "CEB"),
        ("CREG", "CEC"),
        ("DREG", "RSTD"),
        ("MREG", "CEM"),
        ("PREG", "CEP"),
        ("PREG", "RSTP"),
        ("OPMODEREG", "CEOPMODE"),
        ("CARRYINREG", "RSTCARRYIN"),
    ],
)
def test_enable_and_reset(tiny, regs, pin):
    net = dsp(tiny, regs=regs, pins={pin: "q"})
    assert groups(net)[f"DSP48A1.{pin}"] == pytest.approx(INTO + 0.30 + END)


def test_enable_of_an_unused_register_is_no_endpoint(tiny):
    assert "DSP48A1.CEM" not in groups(dsp(tiny, regs="PREG", pins={"CEM": "q"}))


def cascade(tiny, first, second, *, opmode=PRODUCT_ADD_PCIN):
    """Two slices of a column; the second gives to flip-flop z."""
    tiny.add("DSP48A1", "d1", {**NONE, **first}, CLK="clk", OPMODE=list(PRODUCT), PCOUT=["k"])
    tiny.add(
        "DSP48A1", "d2", {**NONE, **second}, CLK="clk", OPMODE=list(opmode), PCIN=["k"], P=["y"]
    )
    return tiny.ff("y", "z").netlist()


def test_cascade_into_preg(tiny):
    net = cascade(tiny, {"PREG": 1}, {"PREG": 1})
    assert groups(net)["DSP48A1.PCIN"] == pytest.approx(1.40 + 0.059 + 2.40 + END)


def test_cascade_to_fabric(tiny):
    net = cascade(tiny, {"PREG": 1}, {})
    assert groups(net)["FDRE.D"] == pytest.approx(1.40 + 0.059 + 2.60 + OUT + END)


def test_cascade_of_two_combinational_slices(tiny):
    """Register A of the first slice, its multiplier, the post-adder of both: the longest kind."""
    net = cascade(tiny, {"A1REG": 1}, {})
    assert groups(net)["FDRE.D"] == pytest.approx(3.90 + 0.059 + 2.60 + OUT + END)


def test_p_into_pcin_of_fabric_is_an_ordinary_net(tiny):
    tiny.add("DSP48A1", "d1", {**NONE, "PREG": 1}, OPMODE=list(PRODUCT), P=["k"])
    tiny.add("DSP48A1", "d2", {**NONE, "CREG": 1}, OPMODE=list(PRODUCT_ADD_C), C=["k"])
    assert groups(tiny.netlist())["DSP48A1.C"] == pytest.approx(1.40 + 0.553 + 0.13 + END)


@pytest.mark.parametrize(("regs", "clock_to_m"), [("MREG", 1.40), ("A1REG", 3.20)])
def test_register_to_m(tiny, regs, clock_to_m):
    net = dsp(tiny, "00000000", regs=regs, out="M")
    assert groups(net)["FDRE.D"] == pytest.approx(clock_to_m + OUT + END)


def test_pin_to_m(tiny):
    net = dsp(tiny, "00000000", pins={"B": ["q"]}, out="M")
    assert groups(net)["FDRE.D"] == pytest.approx(INTO + 2.90 + OUT + END)


def test_b_cascade(tiny):
    tiny.ff("in", "q")
    tiny.add("DSP48A1", "d1", NONE, OPMODE=list(PRODUCT), B=["q"], BCOUT=["k"])
    tiny.add("DSP48A1", "d2", {**NONE, "B1REG": 1}, OPMODE=list(PRODUCT), B=["k"])
    expected = INTO + 0.60 + 0.059 + 0.18 + END
    assert groups(tiny.netlist())["DSP48A1.B"] == pytest.approx(expected)


def test_registered_b_cascade(tiny):
    tiny.add("DSP48A1", "d1", {**NONE, "B1REG": 1}, OPMODE=list(PRODUCT), BCOUT=["k"])
    tiny.add("DSP48A1", "d2", {**NONE, "B0REG": 1}, OPMODE=list(PRODUCT), B=["k"])
    assert groups(tiny.netlist())["DSP48A1.B"] == pytest.approx(1.40 + 0.059 + 0.18 + END)


PREADD = "10001000"  # X = M, pre-adder in front of B1


@pytest.mark.parametrize(
    ("regs", "pin", "ns"),
    [
        ("B1REG", "B", 2.30 + 0.18),
        ("B1REG", "D", 2.30 + 0.18),
        ("MREG", "D", 2.30 + 2.90),
        ("PREG", "B", 2.30 + 3.40),
    ],
)
def test_preadder_in_front(tiny, regs, pin, ns):
    net = dsp(tiny, PREADD, regs=regs, pins={pin: ["q"]})
    assert groups(net)[f"DSP48A1.{pin}"] == pytest.approx(INTO + ns + END)


def test_preadder_between_registers(tiny):
    net = dsp(tiny, PREADD, regs="B0REG DREG B1REG MREG")
    assert insides(net) == {
        ("d.B0REG", "d.B1REG"): pytest.approx(2.30 + 0.18),
        ("d.DREG", "d.B1REG"): pytest.approx(2.30 + 0.18),
        ("d.B1REG", "d.MREG"): pytest.approx(3.003),
    }


@pytest.mark.parametrize(("params", "ns"), [({"CARRYOUTREG": 1}, 1.40), ({"CARRYOUTREG": 0}, 2.20)])
def test_carry_out(tiny, params, ns):
    params = {**NONE, "MREG": 1, **params}
    tiny.add("DSP48A1", "d", params, OPMODE=list(PRODUCT), CARRYOUT="y").ff("y", "z")
    assert groups(tiny.netlist())["FDRE.D"] == pytest.approx(ns + OUT + END)


def test_parameters_left_out_have_the_default_of_the_primitive(tiny):
    """A1, B1, C, D, M, P, OPMODE are registered, A0 and B0 are not."""
    tiny.ff("in", "q").add("DSP48A1", "d", A=["q"], C=["q2"], OPMODE=list(PRODUCT_ADD_C), P=["y"])
    tiny.ff("in", "q2").ff("y", "z")
    got = groups(tiny.netlist())
    assert got["DSP48A1.A"] == pytest.approx(INTO + 0.18 + END)
    assert got["DSP48A1.C"] == pytest.approx(INTO + 0.13 + END)
    assert got["FDRE.D"] == pytest.approx(1.40 + OUT + END)
    assert insides(tiny.netlist())[("d.A1REG", "d.MREG")] == pytest.approx(3.003)


@pytest.mark.parametrize("opmode", [ACCUMULATE, "01000000"])
def test_accumulator_without_register(tiny, opmode):
    with pytest.raises(
        NetlistError, match=r"^PREG of cell d must be 1 where OPMODE feeds P back, not 0$"
    ):
        build_graph(dsp(tiny, opmode, regs="MREG"))
