"""Memory contents taken out of the Verilog."""

from __future__ import annotations

import pytest

from boresight.gateware.core import build_core
from boresight.sim.rtl.memories import split_memories
from tests.support.random_program import random_program


@pytest.mark.parametrize("config", ["small", "fast"])
def test_cores_of_one_machine_differ_in_memories_only(config):
    cores = [build_core(random_program(seed), config, restarts=0) for seed in (1, 2)]
    (a, files_a), (b, files_b) = (split_memories(c.verilog(instances=False)) for c in cores)
    assert a == b
    assert files_a.keys() == files_b.keys()
    assert files_a["rom0.hex"] != files_b["rom0.hex"]


def test_words_survive():
    core = build_core(random_program(3), "small", restarts=0)
    _, files = split_memories(core.verilog(instances=False))
    words = [int(x, 16) for x in files["rom0.hex"].split()]
    assert (words,) == core.image.hardware_rom(core.machine)
    operands = [int(x, 16) for x in files["b0.hex"].split()]
    assert operands == list(core.image.registers) + list(core.image.tables)


def test_no_core_is_refused():
    with pytest.raises(ValueError, match=r"^the Verilog must have initialised memories, not none$"):
        split_memories("module x; endmodule\n")
