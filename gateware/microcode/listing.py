"""Listing: microcode, read back from its bits, as text with the names of the values.

For each cycle: issues, gets, writes and emits of each lane. Fields of one slot are collected
from their words, so the listing shows the machine's actions, not the assembler's input.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.assemble import decode
from boresight.gateware.schedule.allocate import Allocation
from boresight.gateware.schedule.slots import Schedule
from boresight.model.words.program import Program

_SIGN = {(0, 0): "+", (1, 0): "-", (0, 1): "-if ", (1, 1): "-unless "}
_WHEN = {(1, 0): "", (0, 1): " if", (1, 1): " unless"}
_SCALE = ("", "-n", "-(n&~1)", "-(n>>1)")


def actions(
    rom: Sequence[int], schedule: Schedule, allocation: Allocation
) -> list[tuple[str, ...]]:
    """For each cycle what every lane issues, and what is written and sent; ``rom``: the microwords.

    Registers appear as the ``name`` of the value in them in that cycle; a register without a value
    appears as ``r17``.
    """
    lines = _Listing(rom, schedule.machine, schedule.program, allocation)
    return [(*lines.issues(cycle), lines.events(cycle)) for cycle in range(len(rom))]


class _Listing:
    def __init__(
        self, rom: Sequence[int], machine: Machine, program: Program, allocation: Allocation
    ) -> None:
        self.machine = machine
        self.words = [decode(machine, w) for w in rom]
        self.stage = {f.name: f.stage for f in machine.fields}
        self.names: dict[int, list[tuple[int, int, str]]] = {}
        for t in allocation.live_ranges:
            name = program.values[t.value].name
            self.names.setdefault(t.address, []).append((t.start, t.end, name))

    def field(self, name: str, cycle: int) -> int:
        """Field of the slot issued in ``cycle``."""
        word = cycle + self.stage[name]
        return self.words[word][name] if word < len(self.words) else 0

    def register(self, address: int, cycle: int) -> str:
        """Name of the value in a register in a cycle."""
        for start, end, name in self.names.get(address, ()):
            if start <= cycle <= end:
                return name
        return f"r{address}"

    def written(self, lane: int, offset: int, cycle: int) -> str:
        """Name of the value in a register from the next cycle on."""
        address = lane * self.machine.bank_depth + offset
        for start, _, name in self.names.get(address, ()):
            if start == cycle + 1:
                return name
        return f"r{address}"

    def issues(self, cycle: int) -> list[str]:
        """Text of the slot of every lane."""
        return [self.issue(cycle, k) for k in range(self.machine.lanes)]

    def issue(self, cycle: int, lane: int) -> str:
        """Text of a lane's slot."""

        def f(name: str) -> int:
            return self.field(f"{name}{lane}", cycle)

        when = (f("when"), f("when_flag"))
        a = self.register(f("a_addr"), cycle)
        captures = [kind for kind in ("index", "flag", "norm") if f(f"cap_{kind}")]
        out = ""
        if when in _WHEN:
            if f("table"):
                b = f"table{f('b_addr') >> 2}[{f('b_addr') & 3}]"
            else:
                b = self.register(f("b_addr"), cycle)
            a = f"frac({a})" if f("frac_a") else a
            b = f"frac({b})" if f("frac_b") else b
            shift = f"{f('shift')}{_SCALE[f('scale')]}"
            out = f"{_SIGN[f('neg'), f('neg_flag')]}{a} * {b} >> {shift}{_WHEN[when]}"
            out = ("[" if f("first") else " ") + out
        elif captures:
            out = ("[" if f("first") else " ") + a
        if captures:
            out += " ?" + ",".join(captures) + ("+1/4" if f("quarter") else "")
        if f("we"):
            out += " ]"
        if lane == 0 and self.field("emit", cycle):
            out += " emit " + self.register(f("a_addr"), cycle)
        return out.rstrip()

    def events(self, cycle: int) -> str:
        """Gets, writes and emits of a cycle."""
        word = self.words[cycle]
        out = []
        for k in range(self.machine.lanes):
            if k == 0 and word["get"]:
                name = self.written(0, word["dest0"], cycle)
                out.append(f"get {name}" + (" (last)" if word["get_last"] else ""))
            elif word[f"we{k}"]:
                mode = "wrap" if word[f"wrap{k}"] else "sat" if word[f"sticky{k}"] else "clip"
                out.append(f"{self.written(k, word[f'dest{k}'], cycle)} = {mode}{k}")
        if word["emit"]:
            out.append("out" + (" (last)" if word["emit_last"] else ""))
        out += ["home"] if word["home"] else []
        return ", ".join(out)
