"""Timing diagrams as text.

A diagram is made from the schedule; a test drives the core accordingly and compares its signals.
"""

from __future__ import annotations

from dataclasses import dataclass

from boresight.gateware.description import Description, Records
from boresight.gateware.registers.core import STATUS


@dataclass(frozen=True)
class Drawing:
    """Signals in chosen cycles.

    Attributes
    ----------
    cycles : tuple of int
        The cycles shown, ascending; a gap separates cycles that are not consecutive.
    rows : tuple of (str, tuple of int, str or None)
        A signal and its value in each cycle: a bit, the name of a word, or None where it does not
        matter.
    """

    cycles: tuple[int, ...]
    rows: tuple[tuple[str, tuple[int | str | None, ...]], ...]

    def text(self) -> str:
        """Lines of equal length; a gap is two points."""
        names = [name for name, _ in self.rows]
        margin = max(map(len, names)) + 2
        width = 3 + max(len(v) for _, row in self._with_cycles() for v in row if isinstance(v, str))
        lines = []
        for name, row in self._with_cycles():
            cells, before = [], None
            values = iter(row)
            for column in self._columns():
                if column is None:
                    cells.append(" .. ")
                    continue
                value = next(values)
                cells.append(_cell(value, before, width))
                before = value
            lines.append(f"{name:<{margin}}{''.join(cells)}".rstrip() + "\n")
        return "".join(lines)

    def _with_cycles(self) -> list[tuple[str, tuple[int | str | None, ...]]]:
        return [("cycle", tuple(map(str, self.cycles))), *self.rows]

    def _columns(self) -> list[int | None]:
        """The cycles, with None for a gap."""
        out: list[int | None] = []
        for cycle in self.cycles:
            if out and out[-1] != cycle - 1:
                out.append(None)
            out.append(cycle)
        return out


def _cell(value: int | str | None, before: int | str | None, width: int) -> str:
    """One cycle of one signal."""
    if value is None:
        return "." * width
    if isinstance(value, str):
        return " " * width if value == before else f"| {value}".ljust(width)
    edge = {(0, 1): "/", (1, 0): "\\"}.get((before, value)) if isinstance(before, int) else None
    line = "‾" if value else "_"
    return (edge or line) + line * (width - 1)


def record_drawing(program: Records, word: int) -> Drawing:
    """A record of a program, from the first input word to the next record's.

    Cycle 1 is that in which the first word passes. The next record is offered at once, and every
    output word is taken at once.
    """
    interval = program.interval
    gets = {w.cycle: k for k, w in enumerate(program.inputs) if w.cycle is not None}
    gets[interval + 1] = 0
    outs = {cycle: k for k, cycle in enumerate(program.latencies)}
    inputs = [w.name for w in program.inputs]
    outputs = [w.name for w in program.outputs]
    last_in = max(cycle for cycle in gets if cycle <= interval)
    shown = {1, 2, last_in, last_in + 1, min(outs), min(outs) + 1}
    shown |= {cycle + step for cycle in outs if cycle + 1 not in outs for step in (0, 1)}
    shown |= {interval, interval + 1, sorted(gets)[min(1, len(gets) - 1)]}
    cycles = tuple(sorted(cycle for cycle in shown if cycle <= interval + 1))
    waiting = [min(c for c in gets if c >= cycle) for cycle in cycles]
    final = [gets[c] == len(inputs) - 1 for c in waiting]
    return Drawing(
        cycles,
        (
            ("i__valid", (1,) * len(cycles)),
            ("i__ready", tuple(int(c in gets) for c in cycles)),
            ("i__payload", tuple(inputs[gets[c]] for c in waiting)),
            (f"i__payload[{word}]", tuple(map(int, final))),
            ("o__valid", tuple(int(c in outs) for c in cycles)),
            ("o__ready", (1,) * len(cycles)),
            ("o__payload", tuple(outputs[outs[c]] if c in outs else None for c in cycles)),
            (
                f"o__payload[{word}]",
                tuple(int(outs[c] == len(outs) - 1) if c in outs else None for c in cycles),
            ),
        ),
    )


def bus_drawing(core: Description) -> Drawing:
    """A write of a parameter and a read of the status, while the core waits for a record.

    Without parameters, the write clears a flag.
    """
    status = str(STATUS.address)
    addresses = [parameter.address for parameter in core.parameters]
    written = str(addresses[0]) if addresses else status
    waits = int(bool(addresses))  # cycles without an acknowledge
    return Drawing(
        tuple(range(1, waits + 4)),
        (
            ("bus__addr", (*[written] * (waits + 1), status, None)),
            ("bus__w_data", (*["word"] * (waits + 1), None, None)),
            ("bus__w_stb", (*[1] * (waits + 1), 0, 0)),
            ("bus__w_ack", (*[0] * waits, 1, 0, 0)),
            ("bus__r_data", (*[None] * (waits + 2), "status")),
        ),
    )
