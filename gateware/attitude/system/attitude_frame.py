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
#: Fraction bits of quaternion and status by the filter's number, for the usual four filters.
FORMATS = {0: (29, 23), 1: (31, 27), 2: (31, 26), 3: (31, 24)}

#: The filter's outputs in the order of the frame and of the result memory.
OUTPUTS = ("pitch", "roll", "heading", "qw", "qx", "qy", "qz", "status")
#: Names of a frame's words.
WORDS = ("header", "stamp", *OUTPUTS)
#: Fields of the header by name; those from bit 16 on are the flags.
_HEADER = {field.name: field for field in (*HEADER, *FRAME_FLAGS)}
_FLAGS = _HEADER["filter"].bit
_DEGREES = 180.0 / (1 << WORD - 1)  #: of a word's last bit


def filter_of(flags: int) -> int:
    """Number of the filter in the header's upper half."""
    return _HEADER["filter"].of(flags << _FLAGS)


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
    """One update: its number, the header's upper half, its stamp, and what it was computed from."""

    number: int
    flags: int
    stamp: int
    sensed: Sensed | None = None

    @property
    def filter(self) -> int:
        """Number of the filter that ran."""
        return filter_of(self.flags)

    @property
    def flag_names(self) -> tuple[str, ...]:
        """Names of the flags that are set."""
        header = self.flags << _FLAGS
        return tuple(f.name for f in _HEADER.values() if f.width == 1 and f.of(header))


def _flags(header: int) -> int:
    return header >> _FLAGS & 0xFFFF


@dataclass(frozen=True, kw_only=True)
class Attitude(Update):
    """One attitude. Angles in degrees; missing values are None.

    ``heading`` is counter-clockwise; the compass bearing is its negative.
    """

    heading: float
    pitch: float
    roll: float
    status: int | None
    quaternion: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Values(Update):
    """Outputs of another estimator, by name, in their units."""

    values: dict[str, float]


def values_of(words: Sequence[int], outputs: Mapping[str, int]) -> Values:
    """The outputs of a frame's signed words.

    Parameters
    ----------
    outputs : mapping
        Fraction bits by name, in the order of the words.
    """
    header, stamp, *output_words = words
    parts = zip(outputs.items(), output_words, strict=True)
    return Values(
        number=_HEADER["number"].of(header),
        flags=_flags(header),
        stamp=stamp & 0xFFFF_FFFF,
        values={name: word * 2.0**-frac for (name, frac), word in parts},
    )


def attitude_of(words: Sequence[int], formats: Mapping[int, tuple[int, int]] = FORMATS) -> Attitude:
    """The attitude of a frame's signed words.

    Parameters
    ----------
    words : sequence of int
        Words of the frame.
    formats : mapping
        As `FORMATS`. Of a filter that is not there, quaternion and status are None.
    """
    named = dict(zip(WORDS, words, strict=True))
    flags = _flags(named["header"])
    quaternion, status = None, None
    if (bits := formats.get(filter_of(flags))) is not None:
        w, x, y, z = (named[n] / (1 << bits[0]) for n in ("qw", "qx", "qy", "qz"))
        quaternion, status = (w, x, y, z), named["status"] >> bits[1]
    return Attitude(
        number=_HEADER["number"].of(named["header"]),
        flags=flags,
        stamp=named["stamp"] & 0xFFFF_FFFF,
        status=status,
        quaternion=quaternion,
        heading=named["heading"] * _DEGREES,
        pitch=named["pitch"] * _DEGREES,
        roll=named["roll"] * _DEGREES,
    )
