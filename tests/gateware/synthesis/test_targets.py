"""Targets, what a core takes on them, and the router: a stand-in, and the program where it is."""

import dataclasses
import json
import time

import pytest

from boresight.gateware.synthesis import tools
from boresight.gateware.synthesis.routed import implement, netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.tools import RouteError, find_program, place_and_route
from boresight.model.errors import InputError, ToolMissing
from tests.support.router import REPORT, is_installed, stand_in

COUNTER = """
module top(input clk, input step, output reg [7:0] n);
    always @(posedge clk) if (step) n <= n + 1;
endmodule
"""


@pytest.fixture
def router(tmp_path, monkeypatch):
    """A program that behaves like nextpnr as far as this package looks."""
    yield stand_in(tmp_path, monkeypatch, version=f"9.{time.time_ns()}")  # in no cache
    find_program.cache_clear()


def test_the_slowest_clock(router):
    arguments = router(f"pathlib.Path('report.json').write_text({json.dumps(REPORT)!r})")
    run = place_and_route({"modules": {}}, TARGETS["ecp5-85k-7"], seed=3, clock_mhz=120)
    assert run.clock_mhz == 66.69 and run.seed == 3
    text = " ".join(arguments())
    for option in ("--85k", "--speed 7", "--seed 3", "--freq 120", "--timing-allow-fail"):
        assert option in text


def test_its_own_words_and_its_log(router):
    router("print('ERROR: Unable to place cell', file=sys.stderr); sys.exit(1)")
    with pytest.raises(
        RouteError, match=r"ecp5-25k \(exit code 1\): ERROR: Unable to place cell \(log: .*\.log\)"
    ):
        place_and_route({"modules": {}}, TARGETS["ecp5-25k"], seed=1, clock_mhz=100)


def test_a_router_that_is_missing_has_a_line_that_installs_it(monkeypatch):
    monkeypatch.setattr(tools.shutil, "which", lambda name: None)
    monkeypatch.setattr(tools.importlib.util, "find_spec", lambda name: None)
    find_program.cache_clear()
    with pytest.raises(ToolMissing, match=r"pip install boresight\[ice40\]"):
        tools.find_router(TARGETS["ice40-up5k"].family.router)
    find_program.cache_clear()


def test_cells_are_counted():
    mapped = netlist_for(COUNTER, "top", TARGETS["ecp5-25k"])
    assert mapped.used["ff"] == 8 and 7 <= mapped.used["lut"] <= 24 and not mapped.used["dsp"]


def test_a_part_that_is_too_small(monkeypatch):
    small = TARGETS["ecp5-25k"]
    memories = {**small.family.cells, "TRELLIS_FF": {"ff": 1, "ram": 10}}
    family = dataclasses.replace(small.family, cells=memories)
    with pytest.raises(InputError) as error:
        netlist_for(COUNTER, "top", dataclasses.replace(small, family=family))
    assert str(error.value) == (
        "target ecp5-25k: wanted 56 DP16KD, block RAM of 18 Kbit, found 80 (24 too many); "
        "choose ecp5-45k"
    )


def test_targets_have_parts_that_a_report_can_name():
    for name, target in TARGETS.items():
        assert name.startswith(target.device.name) and target.grade in target.device.grades
        assert {"lut", "ff", "dsp", target.device.memory} <= set(target.device.resources)
        sizes = [d.capacity("lut") for d in target.family.devices]
        assert sizes == sorted(sizes)


def test_a_counter_is_routed():
    """By nextpnr itself; without it, the line that installs it is the answer."""
    target = TARGETS["ecp5-25k"]
    if not is_installed("nextpnr-ecp5"):
        with pytest.raises(ToolMissing, match=r"boresight\[ecp5\]"):
            implement(COUNTER, "top", target)
        return
    routed = implement(COUNTER, "top", target, seeds=2)
    assert routed.clock_mhz is not None and 100 < routed.clock_mhz < 1000
    assert routed.clock_mhz <= min(run.clock_mhz for run in routed.runs)
    assert routed.mapped.used["ff"] == 8
    assert "worst of seeds 1 to 2" in str(routed)
