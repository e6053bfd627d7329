"""The memories of core.v, read back."""

import random
import re

import pytest

from boresight.gateware.core import build_core
from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.microcode.image import Refuted, check_memories
from tests.support.random_program import random_program


@pytest.mark.parametrize("config", ALL_CONFIGS)
def test_one_digit(config: str) -> None:
    """Each word of each memory counts."""
    core = build_core(random_program(7, n_ops=20), config)
    text = core.verilog(instances=False)
    check_memories(core.machine, core.image, text)
    words = list(re.finditer(r"(?m)^ +(\w+)\[\d+\] = \d+'[hd]([0-9a-f]+);", text))
    by_memory = {match[1]: match for match in random.Random(config).sample(words, len(words))}
    assert {"rom0"} < by_memory.keys()
    for name, match in by_memory.items():
        at = match.end() - 2
        changed = text[:at] + str((int(text[at], 16) + 1) % 8) + text[at + 1 :]
        with pytest.raises(Refuted, match=rf"^core\.v: word \d+ of memory ({name}|rom\b)"):
            check_memories(core.machine, core.image, changed)
