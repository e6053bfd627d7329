"""Attitude messages of a board, in software: frames of kind ATTITUDE and SENSED.

A frame (`gateware.boards.frames`) has header, stamp, and the outputs of the estimator that ran: of
an attitude filter ten words in all.

==== ========= ==================================================================================
word name      contents
==== ========= ==================================================================================
0    header    `gateware.attitude.system.interface.HEADER`, and above it `FRAME_FLAGS`
1    stamp     clock cycle of the sample's data-ready edge, modulo 2^32
2    pitch     half turns, 31 fraction bits
3    roll      the same
4    heading   the same; counter-clockwise, seen from above (docs/conventions.md)
5..8 qw..qz    quaternion, body to navigation
9    status    bits, as the filter that ran defines them
==== ========= ==================================================================================

Words are those of the filter: how many fraction bits quaternion and status have depends on which
one ran (`FORMATS`, or the register map's output records).

A frame of kind SENSED has six more words, 24 bytes in all, least significant byte first: gyro x, y,
z and accelerometer x, y, z in 3 bytes each, counts with 8 fraction bits (of the gyro in its range
of +-300 deg/s); and the three numbers of the compass's line in 2 bytes each, which count if the
header has ``field_used``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from boresight.gateware.attitude.system.interface import FRAME_FLAGS, HEADER

#: Bits of a word.
WORD = 32
#: The filter's outputs in the order of the frame and of the result memory.
OUTPUTS = ("pitch", "roll", "heading", "qw", "qx", "qy", "qz", "status")
#: Names of a frame's words.
WORDS = ("header", "stamp", *OUTPUTS)
#: The angles alone: of a filter whose other fraction bits are not known.
ANGLES = dict.fromkeys(OUTPUTS[:3], 31)
#: Fraction bits of the outputs by the filter's number, for the usual four filters.
FORMATS = {
    number: ANGLES | dict.fromkeys(("qw", "qx", "qy", "qz"), q) | {"status": status}
    for number, (q, status) in enumerate(((29, 23), (31, 27), (31, 26), (31, 24)))
}
#: Fields of the header by name; those from bit 16 on are the flags.
FIELDS = {field.name: field for field in (*HEADER, *FRAME_FLAGS)}


def filter_of(header: int) -> int:
    """Number of the filter in a header."""
    return FIELDS["filter"].of(header)


@dataclass(frozen=True, kw_only=True)
class Sensed:
    """What an update was computed from, and its words.

    ``outputs``: words of the filter. ``counts``: gyro and accelerometer, x, y, z each. ``line``:
    numbers of the compass's line, as its parser read them.
    """

    outputs: tuple[int, ...]
    counts: tuple[float, ...]
    line: tuple[int, ...]


#: Words of a frame that `sensed_of` reads, and their bytes: of a count, of a number of the line.
SENSED_WORDS, _COUNT_BYTES, _LINE_BYTES = 6, 3, 2


def sensed_of(words: Sequence[int]) -> Sensed:
    """What a frame of kind SENSED has beside an attitude; ``words`` are all of its signed words."""
    split = len(words) - SENSED_WORDS
    data = b"".join((w & 0xFFFF_FFFF).to_bytes(4, "little") for w in words[split:])

    def numbers(first: int, size: int, count: int) -> tuple[int, ...]:
        parts = (data[first + k * size : first + (k + 1) * size] for k in range(count))
        return tuple(int.from_bytes(part, "little", signed=True) for part in parts)

    return Sensed(
        outputs=tuple(words[2:split]),
        counts=tuple(c / 256 for c in numbers(0, _COUNT_BYTES, 6)),
        line=numbers(6 * _COUNT_BYTES, _LINE_BYTES, 3),
    )


@dataclass(frozen=True, kw_only=True)
class Update:
    """One update: its number, the header's upper half, its stamp, and its values.

    ``values`` are the outputs by name in their units; of an attitude ``heading_deg``,
    ``pitch_deg`` and ``roll_deg`` stand for the angles. The heading is counter-clockwise; the
    compass bearing is its negative. ``sensed`` is what it was computed from, if the frame has it.
    """

    number: int
    flags: int
    stamp: int
    values: dict[str, float]
    sensed: Sensed | None = None

    @property
    def filter(self) -> int:
        """Number of the filter that ran."""
        return filter_of(self.flags << 16)

    @property
    def is_attitude(self) -> bool:
        """Whether the values are an attitude."""
        return "heading_deg" in self.values

    @property
    def flag_names(self) -> tuple[str, ...]:
        """Names of the flags that are set."""
        return tuple(n for n, f in FIELDS.items() if f.width == 1 and f.of(self.flags << 16))


def update_of(
    words: Sequence[int], outputs: Mapping[str, int], sensed: Sensed | None = None
) -> Update:
    """The update of a frame's signed words; ``outputs`` are fraction bits in their order."""
    header, stamp, *rest = words
    parts = zip(outputs.items(), rest, strict=False)
    values = {name: word * 2.0**-frac for (name, frac), word in parts}
    if outputs is ANGLES or tuple(outputs) == OUTPUTS:
        angles = {f"{name}_deg": 180.0 * values.pop(name) for name in ("heading", *OUTPUTS[:2])}
        values = angles | values
    return Update(
        number=FIELDS["number"].of(header),
        flags=header >> 16 & 0xFFFF,
        stamp=stamp & 0xFFFF_FFFF,
        values=values,
        sensed=sensed,
    )
