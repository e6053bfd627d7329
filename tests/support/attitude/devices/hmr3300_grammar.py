"""What a reader of the HMR3300 must make of a stream of bytes: regular expressions and `int`.

Written for being plain, and apart from the gateware on purpose: the parser is measured by it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

#: Stands for a byte with a framing error.
BROKEN = 256
#: Stands for a pause.
PAUSE = 257

_HEADING = re.compile(
    r" {0,7}([0-9]{1,3}\.[0-9]), {0,7}(-?[0-9]{1,3}\.[0-9]),"
    r" {0,7}(-?[0-9]{1,3}\.[0-9])\r\n"
)
_COUNTS = re.compile(r" {0,7}(-?[0-9]{1,5}), {0,7}(-?[0-9]{1,5}), {0,7}(-?[0-9]{1,5})\r\n")


@dataclass(frozen=True)
class Event:
    """What happens at a byte.

    Attributes
    ----------
    kind : str
        "heading" or "counts" (a good line), "rejected", "invalid" (the compass refuses a command),
        "framing".
    values : tuple of int
        Tenths of a degree, or counts.
    """

    kind: str
    values: tuple[int, ...] = ()


def _line(text: str, angle_max: int) -> Event:
    """The event of a line without framing errors, LF included."""
    if text.startswith("#I"):
        return Event("invalid")
    heading, counts = _HEADING.fullmatch(text), _COUNTS.fullmatch(text)
    if heading:
        values = tuple(int(field.replace(".", "")) for field in heading.groups())
        if values[0] < 3600 and max(abs(values[1]), abs(values[2])) <= angle_max:
            return Event("heading", values)
    if counts:
        values = tuple(int(field) for field in counts.groups())
        if max(map(abs, values)) < 32_768:
            return Event("counts", values)
    return Event("rejected")


def events_of(symbols: Iterable[int], *, angle_max: int = 900) -> Iterator[Event]:
    """Events in their order.

    Everything up to the first LF is the rest of a line that began before, and so is what follows
    the last LF.

    Parameters
    ----------
    symbols : iterable of int
        Bytes, `BROKEN` or `PAUSE`.
    angle_max : int
        Largest magnitude of pitch and roll.
    """
    line: list[int] = []
    known = False
    for symbol in symbols:
        if symbol == BROKEN:
            yield Event("framing")
        if symbol != PAUSE or line:
            line.append(symbol)
        if symbol == ord("\n"):
            if known:
                # A framing error or a pause is a character that fits nowhere.
                yield _line("".join(map(chr, line)), angle_max)
            known, line = True, []


def heading_sentence(heading: int, pitch: int, roll: int) -> bytes:
    """The compass's sentence for tenths of a degree."""

    def text(tenths: int) -> str:
        return f"{'-' * (tenths < 0)}{abs(tenths) // 10}.{abs(tenths) % 10}"

    return f"{text(heading)}, {text(pitch)}, {text(roll)}\r\n".encode()


def counts_sentence(x: int, y: int, z: int) -> bytes:
    """The compass's sentence for counts."""
    return f"{x}, {y}, {z}\r\n".encode()
