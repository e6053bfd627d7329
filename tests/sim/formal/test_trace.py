"""Counterexamples read from a value change dump, and as a person reads them."""

from boresight.sim.formal.trace import Trace, read_trace

VCD = """\
$date today $end
$scope module top $end
$scope module harness $end
$var wire 1 ! clk $end
$var wire 1 a go $end
$var wire 4 b count [3:0] $end
$var wire 1 c $auto$1 $end
$var wire 1 d _hidden $end
$var integer 32 t smt_step $end
$scope module part $end
$var wire 4 e inner [3:0] $end
$var wire 4 b count [3:0] $end
$var wire 1 f late $end
$upscope $end
$upscope $end
$upscope $end
$enddefinitions $end
#0
1a
b0000 b
bx01x e
b00000000000000000000000000000000 t
1!
#5
0!
#10
0a
b1010 b
1!
#15
1f
0!
#20
1!
#25
0!
"""


def test_values_of_the_cycles() -> None:
    """As they stand before the clock falls; bits that may be anything are 0."""
    assert read_trace(VCD).values == {
        "go": (1, 0, 0),
        "part.count": (0, 10, 10),
        "part.inner": (2, 2, 2),
        "part.late": (0, 0, 1),
    }


def test_without_a_scope_of_the_harness() -> None:
    text = VCD.replace("$scope module harness $end\n", "").replace("$upscope $end\n", "", 1)
    assert read_trace(text).values == read_trace(VCD).values


TRACE = Trace({"go": (1, 0, 0, 0), "part.x": (1, 2, 2, 10), "part.in.y": (0, 0, 0, 0)})


def test_first_all_then_what_changes() -> None:
    assert TRACE.cycles == 4 and Trace({}).cycles == 0
    assert TRACE.text().splitlines() == [
        "    0: go=0x1 part.x=0x1 part.in.y=0x0",
        "    1: go=0x0 part.x=0x2",
        "    2: -",
        "    3: part.x=0xa",
    ]


def test_the_end_of_it_or_the_harness_alone() -> None:
    assert TRACE.text(last=2).splitlines() == [
        "    2: go=0x0 part.x=0x2 part.in.y=0x0",
        "    3: part.x=0xa",
    ]
    assert TRACE.text(last=1, parts=False) == "    3: go=0x0"
