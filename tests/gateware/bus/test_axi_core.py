"""The ports of `core_axi` are those of its Verilog; test_files.py runs it."""

from __future__ import annotations

import re
from pathlib import Path

from boresight.gateware.bus.axi_core import axi_ports
from boresight.sim.levels.build import Build


def test_ports(one: tuple[Path, Build]) -> None:
    text = (one[0] / "core_axi.v").read_text()
    module = text[text.index("\nmodule core_axi(") :].partition("endmodule")[0]
    found = re.findall(r"^  (input|output) (?:\[(\d+):0\] )?(\w+);$", module, re.M)
    assert {(side, name, int(high or 0) + 1) for side, high, name in found} == set(axi_ports())
    assert [name for _, name, _ in axi_ports()][:3] == ["aclk", "aresetn", "s_axis_tdata"]
    assert "always @*" not in text and len(re.findall(r"^  core core \(", text, re.M)) == 1
