"""Memory contents of a core's Verilog as files, so that one built simulation runs any program.

Programs on the same machine differ only in the contents of their memories. The
simulation is built once from the Verilog with every ``initial begin mem[0] = ...`` replaced by
``$readmemh``, and each run supplies its own files.
"""

from __future__ import annotations

import re

__all__ = ["split_memories"]

_BLOCK = re.compile(
    r"  initial begin\n((?:    (?P<name>[^\s\[]+)\[\d+\] = \d+'[dhb][0-9a-fx]+;\n)+)  end\n"
)
_WORD = re.compile(r"\[(\d+)\] = \d+'([dhb])([0-9a-f]+);")
_BASE = {"d": 10, "h": 16, "b": 2}


def split_memories(verilog: str) -> tuple[str, dict[str, str]]:
    """Verilog that reads its memories from files, and the files by name.

    Raises
    ------
    ValueError
        The text has no initialised memory, so it is not a core.
    """
    files: dict[str, str] = {}

    def replace(match: re.Match[str]) -> str:
        name = match["name"]
        file = f"{name}.hex"
        if file in files:
            raise ValueError(f"memory {name} must have one name in the core, not several")
        words = [(int(n), int(text, _BASE[base])) for n, base, text in _WORD.findall(match[1])]
        if [n for n, _ in words] != list(range(len(words))):
            raise ValueError(f"memory {name} must be initialised in order")
        files[file] = "".join(f"{word:x}\n" for _, word in words)
        return f'  initial $readmemh("{file}", {name});\n'

    text = _BLOCK.sub(replace, verilog)
    if not files:
        raise ValueError("the Verilog must have initialised memories, not none")
    return text, files
