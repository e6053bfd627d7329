"""`sim.report.sources`: the nearest named ancestor, and what the tool is called."""

from __future__ import annotations

import dataclasses

from boresight.gateware.synthesis.device import XC6SLX9
from boresight.gateware.synthesis.estimate import Estimate
from boresight.sim.report.sources import source_of, sources, tool_of


def test_nearest_ancestor() -> None:
    data = {"sources": {"a": "all of it", "a.b.c": "this one"}}
    assert source_of(data, "a.b.c.0") == source_of(data, "a.b.c") == "this one"
    assert source_of(data, "a.b") == source_of(data, "a.b.cd") == "all of it"
    assert source_of(data, "b") is None


def test_tool(estimate: Estimate) -> None:
    assert tool_of(estimate) == "Yosys 0.70 (git sha1 0123abc)"
    assert tool_of(dataclasses.replace(estimate, version="Yosys 0.9")) == "Yosys 0.9"


def test_only_what_there_is(estimate: Estimate) -> None:
    data = {"firmware": {"source": None}}
    bare = sources(data, None, "", XC6SLX9)
    assert "resources" not in bare and "firmware.updates_per_s" not in bare
    assert bare["numerics"] == "range: compiled (range_source)"
    full = sources({"firmware": {"source": "a clock"}}, estimate, "9 updates of a log", XC6SLX9)
    assert full["firmware.updates_per_s"] == "a clock"
    assert full["numerics"].endswith("measured on the C model, 9 updates of a log")
    assert full["resources"].endswith("yosys -p synth")
