"""Shared by the tests of the soft core's parts: what Amaranth's simulator cannot hold, replaced.

Memory and processor are Verilog. Here the memory is one of Amaranth's with the same ports, and the
processor is left out: the bench drives its buses instead.
"""

from typing import Any

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import memory

from boresight.gateware.attitude.soc import cpu
from boresight.gateware.attitude.soc import memory as soc_memory


class _Ram:
    """`ram.v` in Amaranth; ``contents`` is its memory, for the bench to look at."""

    contents: Any

    def __call__(self, name: str, *, p_WORDS: int, p_WIDTH: int, p_IMAGE: str, **p: Any) -> Module:
        assert name == "boresight_ram" and p_WIDTH == (p_WORDS - 1).bit_length()
        m = Module()
        m.submodules.memory = self.contents = memory.Memory(shape=32, depth=p_WORDS, init=[])
        write = self.contents.write_port(granularity=8)
        for letter in "ab":
            read = self.contents.read_port()
            m.d.comb += [read.addr.eq(p[f"i_{letter}_addr"]), p[f"o_{letter}_data"].eq(read.data)]
        m.d.comb += [
            write.addr.eq(p["i_b_addr"]),
            write.data.eq(p["i_b_w_data"]),
            write.en.eq(p["i_b_we"]),
        ]
        return m


@pytest.fixture
def ram(monkeypatch: pytest.MonkeyPatch) -> _Ram:
    """The memory of the component that is elaborated next."""
    model = _Ram()
    monkeypatch.setattr(soc_memory, "Instance", model)
    return model


@pytest.fixture
def processor(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Connections of the processor that is left out, by port."""
    ports: dict[str, Any] = {}

    def absent(name: str, **connections: Any) -> Module:
        assert name == "VexRiscv"
        m = Module()
        reset = Signal()
        m.d.comb += reset.eq(connections["i_reset"])
        ports.update({**connections, "i_reset": reset})
        return m

    monkeypatch.setattr(cpu, "Instance", absent)
    return ports
