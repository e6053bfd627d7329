"""Attitude messages of a board, in software: frames of kind ATTITUDE and lines of text.

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

A line of text has fixed columns and ends with CR LF::

    +123.45 -012.34 +001.23 002A 0108 018

heading, pitch and roll in degrees, then in hexadecimal: number of the update, the header's upper
half, bits 31:20 of the status word. An angle of the word n is the sign of n, and ``(|n| * 36000 +
2^31) >> 32`` hundredths of a degree: rounded to the nearest, halves away from zero.
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
_HUNDREDTHS = 36_000  #: of a degree, in a turn
_DEGREES = 180.0 / (1 << WORD - 1)  #: of a word's last bit


def filter_of(flags: int) -> int:
    """Number of the filter in the header's upper half."""
    return _HEADER["filter"].of(flags << _FLAGS)


@dataclass(frozen=True, kw_only=True)
class Update:
    """One update: its number, the header's upper half, and its stamp where that is known."""

    number: int
    flags: int
    stamp: int | None = None

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

    Raises
    ------
    ValueError
        There are not as many words.
    """
    if len(words) != 2 + len(outputs):
        raise ValueError(f"words must be {2 + len(outputs)}, not {len(words)}")
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

    Raises
    ------
    ValueError
        There are not ten words.
    """
    if len(words) != len(WORDS):
        raise ValueError(f"words must be {len(WORDS)}, not {len(words)}")
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


def angle_text(value: int) -> str:
    """Degrees of an angle's signed word, as the board writes them."""
    hundredths = (abs(value) * _HUNDREDTHS + (1 << WORD - 1)) >> WORD
    degrees, fraction = divmod(hundredths, 100)
    return f"{'-' if value < 0 else '+'}{degrees:03d}.{fraction:02d}"


def text_line(words: Sequence[int]) -> str:
    """The line of text for the words of a frame, with its end."""
    named = dict(zip(WORDS, words, strict=True))
    number, flags = _HEADER["number"].of(named["header"]), _flags(named["header"])
    status = named["status"] >> 20 & 0xFFF
    angles = " ".join(angle_text(named[n]) for n in ("heading", "pitch", "roll"))
    return f"{angles} {number:04X} {flags:04X} {status:03X}\r\n"


def parse_line(line: str, formats: Mapping[int, tuple[int, int]] = FORMATS) -> Attitude | None:
    """The attitude of a line of text, with or without its end; None if it is none."""
    parts = line.rstrip("\r\n").split(" ")
    if [len(part) for part in parts] != [7, 7, 7, 4, 4, 3]:
        return None
    if any(p[0] not in "+-" or p[4] != "." or not (p[1:4] + p[5:]).isdecimal() for p in parts[:3]):
        return None
    if any(c not in "0123456789ABCDEF" for part in parts[3:] for c in part):
        return None
    heading, pitch, roll = (float(part) for part in parts[:3])
    number, flags, bits = (int(part, 16) for part in parts[3:])
    form = formats.get(filter_of(flags))
    return Attitude(
        number=number,
        heading=heading,
        pitch=pitch,
        roll=roll,
        flags=flags,
        status=None if form is None else bits << 20 >> form[1],
    )
