"""Longest paths as they are reported."""

import pytest

from boresight.gateware.synthesis.delays import Delay, delay_table
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.timing import NOTE, analyse


@pytest.fixture
def two_paths(tiny):
    """q to z through a LUT, and q to w straight; q has two loads."""
    tiny.ff("in", "q").lut("y", "q", "in").ff("y", "z").ff("q", "w")
    return tiny.netlist()


def test_worst_path_step_by_step(two_paths):
    worst = analyse(two_paths).worst
    steps = [
        (p.cell, p.type, p.entry, p.exit, p.net, p.fanout, p.net_ns, p.cell_ns, p.total_ns)
        for p in worst.points
    ]
    assert steps == [
        ("q", "FDRE", "Q", "Q[0]", "", 0, 0.0, 0.525, 0.525),
        ("lut_y", "LUT2", "I0[0]", "O[0]", "q", 2, 0.855, 0.259, 1.639),
        ("z", "FDRE", "D[0]", "Q", "y", 1, 0.0, 0.114, 1.753),
        ("", "clock", "", "", "", 0, 0.0, 0.135, 1.888),
    ]
    assert (worst.start, worst.end, worst.group) == ("q.Q", "z.Q", "FDRE.D")
    assert (worst.logic_ns, worst.net_ns, worst.delay_ns) == (1.033, 0.855, 1.888)


def test_fmax_is_rounded_down(two_paths):
    assert analyse(two_paths).fmax_mhz == 529.6  # 1000 / 1.888 = 529.66


def test_every_point_adds_up_to_the_delay(two_paths):
    for nets in ("median", "p75"):
        worst = analyse(two_paths, nets=nets, grade=3).worst
        assert sum(p.net_ns + p.cell_ns for p in worst.points) == pytest.approx(worst.delay_ns)


def test_ends_are_sorted_and_cut(two_paths):
    ends = analyse(two_paths).ends
    assert [(p.end, p.slack_ns) for p in ends] == [("z.Q", 0.0), ("w.Q", 0.259)]
    assert [p.end for p in analyse(two_paths, top=1).ends] == ["z.Q"]


def test_slack_against_a_clock(two_paths):
    timing = analyse(two_paths, clock_mhz=500)
    assert timing.period_ns == 2.0
    assert [p.slack_ns for p in timing.ends] == [0.112, 0.371]
    assert analyse(two_paths, clock_mhz=1000).worst.slack_ns == -0.888


def test_groups(tiny):
    tiny.ff("in", "q").lut("y", "q").ff("y", "z").ff("in", "w", CE="q").ff("in", "v", CE="q")
    groups = {g.name: g for g in analyse(tiny.netlist()).groups}
    assert set(groups) == {"FDRE.D", "FDRE.CE"}
    assert (groups["FDRE.CE"].count, groups["FDRE.D"].count) == (2, 1)
    # .525 + .855 + .408 + .135 and .525 + .855 + .259 + .114 + .135
    assert groups["FDRE.CE"].worst_ns == pytest.approx(1.923)
    assert groups["FDRE.D"].histogram == {1: 1}


def test_four_corners_are_ordered(two_paths):
    graph = build_graph(two_paths)
    slow = {
        (g, n): analyse(graph, grade=g, nets=n).fmax_mhz for g in (2, 3) for n in ("median", "p75")
    }
    assert slow[2, "p75"] < slow[2, "median"] < slow[3, "median"]
    assert slow[2, "p75"] < slow[3, "p75"] < slow[3, "median"]


def test_guesses_on_the_path_are_listed(tiny):
    tiny.add("DSP48A1", "d", OPMODE=list("10000000"), P=["p"]).add("RAMB16BWER", "r", ADDRA=["p"])
    table = delay_table(grade=2, nets="median").replaced(
        ramb_period=Delay(0, "off"), dsp_abreg_mreg=Delay(0, "off"), dsp_mreg_preg=Delay(0, "off")
    )
    timing = analyse(tiny.netlist(), table=table)
    assert timing.worst.group == "RAMB16BWER.ADDRA"
    assert set(timing.guessed) == {"dsp_preg_p", "clock_uncertainty"}
    assert all(d.guessed for d in timing.guessed.values())


def test_observed_constants_are_not_listed(two_paths):
    assert set(analyse(two_paths).guessed) == {"clock_uncertainty"}


def test_path_inside_a_cell(tiny):
    worst = analyse(tiny.add("DSP48A1", "d", OPMODE=list("10000000"), P=["p"]).netlist()).worst
    assert (worst.start, worst.end, worst.group) == ("d.A1REG", "d.MREG", "DSP48A1 inside")
    assert [(p.entry, p.exit, p.total_ns) for p in worst.points] == [("A1REG", "MREG", 3.003)]


def test_made_up_cell_names_give_way_to_net_names(tiny):
    tiny.add("FDRE", "$auto$1", C="clk", D="in", Q="count").ff("count", "z")
    assert analyse(tiny.netlist()).worst.start == "count.Q"


def test_source_locations_are_kept(tiny):
    tiny.ff("in", "q").ff("q", "z", src="top.v:7.3-7.9")
    assert analyse(tiny.netlist()).worst.points[1].src == "top.v:7.3-7.9"


def test_nothing_to_time(tiny):
    timing = analyse(tiny.lut("y", "a").leave("y").netlist())
    assert (timing.worst, timing.fmax_mhz, timing.ends, timing.guessed) == (None, None, (), {})


def test_always_called_an_estimate(two_paths):
    timing = analyse(two_paths, grade=3, nets="p75")
    assert NOTE == "estimate, not ISE; sign-off needs trce"
    assert timing.source == (
        "static timing, grade -3, p75 nets: estimate, not ISE; sign-off needs trce, "
        "1 guessed constant on the worst path"
    )


def test_messages(two_paths):
    with pytest.raises(ValueError, match=r"^clock_mhz must be above 0, not 0$"):
        analyse(two_paths, clock_mhz=0)
    with pytest.raises(ValueError, match=r"^top must be at least 1, not 0$"):
        analyse(two_paths, top=0)
    with pytest.raises(ValueError, match=r"^grade must be 2 or 3, not 1$"):
        analyse(two_paths, grade=1)
