"""Frames on the serial line: the side of software, and the constants of both sides.

A frame is ``END body END``, with the bytes END and ESC of the body escaped as in SLIP (RFC 1055),
so that END occurs nowhere else: after any fault the next frame is decoded again. The END before a
frame ends garbage from noise; empty frames are ignored.

The body is one byte for the kind, words of ``(W + 7) // 8`` bytes (least significant first), and a
CRC-16 of all of that, least significant byte first: the frame check of HDLC and PPP (RFC 1662;
CRC-16/IBM-SDLC, polynomial 0x1021 reflected, initial value and final exclusive-or 0xFFFF). From the
host bits above the word's W are ignored; to the host words are sign-extended.

======== =================================== ========================================
kind     from the host                       reply, same kind
======== =================================== ========================================
RECORD   the words of an input record        the words of the output record
WRITE    register address, word              register address, when the word is written
READ     register address                    word of the register
ATTITUDE                                     sent by itself: attitudes of a board
SENSED                                       the same, and what they were computed from
======== =================================== ========================================

Boards that read their sensors themselves have no RECORD, boards that are fed by the host no
ATTITUDE and SENSED. Bits of a register address beyond those of the bus are ignored, and are 0 in
the reply.

Every good frame gets one reply, in order (a register read directly after a record may still give
its value before the end of that update). A frame that is damaged, of another kind or of the wrong
length is dropped without reply. One frame may be sent before the reply to the one before; a third
is dropped.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from enum import IntEnum

from amaranth.lib.crc import catalog

END, ESC, END_ESCAPED, ESC_ESCAPED = 0xC0, 0xDB, 0xDC, 0xDD
#: Bytes and their escapes, that of ESC itself first.
_ESCAPES = ((bytes([ESC]), bytes([ESC, ESC_ESCAPED])), (bytes([END]), bytes([ESC, END_ESCAPED])))
_ILLEGAL = re.compile(rb"\xdb(?![\xdc\xdd])")

#: Check of a frame.
CRC = catalog.CRC16_IBM_SDLC(data_width=8)
#: Bytes of the check.
CRC_BYTES = 2


class Kind(IntEnum):
    """First byte of a frame's body. No kind needs an escape; 0 means no kind."""

    RECORD = 1
    WRITE = 2
    READ = 3
    ATTITUDE = 4
    SENSED = 5


def word_bytes(word: int) -> int:
    """Bytes of a word of ``word`` bits on the line."""
    return (word + 7) // 8


def encode(kind: int, words: Iterable[int], *, word: int) -> bytes:
    """A frame, from END to END."""
    count = word_bytes(word)
    mask = (1 << 8 * count) - 1
    body: bytes = bytes([kind]) + b"".join((int(w) & mask).to_bytes(count, "little") for w in words)
    body += CRC.compute(body).to_bytes(CRC_BYTES, "little")
    for plain, escaped in _ESCAPES:
        body = body.replace(plain, escaped)
    return bytes([END]) + body + bytes([END])


class Decoder:
    """Decoder of frames from a board's bytes.

    Attributes
    ----------
    dropped : int
        Number of frames that were neither empty nor good.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        self.dropped = 0
        self._begun = b""

    def feed(self, data: bytes) -> Iterator[tuple[Kind, list[int]]]:
        """Yield kind and signed words of every good frame that ends in ``data``."""
        *frames, self._begun = (self._begun + data).split(bytes([END]))
        for frame in filter(None, frames):
            body = self._body(frame)
            if body is None:
                self.dropped += 1
            else:
                yield body

    def _body(self, frame: bytes) -> tuple[Kind, list[int]] | None:
        """Contents of a frame, None if it is damaged."""
        if _ILLEGAL.search(frame):
            return None
        for plain, escaped in reversed(_ESCAPES):
            frame = frame.replace(escaped, plain)
        size = word_bytes(self.word)
        check, body = frame[-CRC_BYTES:], frame[:-CRC_BYTES]
        if (
            not body
            or (len(body) - 1) % size
            or body[0] not in set(Kind)
            or CRC.compute(body) != int.from_bytes(check, "little")
        ):
            return None
        words = [
            int.from_bytes(body[k : k + size], "little", signed=True)
            for k in range(1, len(body), size)
        ]
        return Kind(body[0]), words
