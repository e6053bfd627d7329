"""A board at the other end of a serial line, and its register map."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable

from boresight.gateware.boards.frames import END, Decoder, Kind, encode
from boresight.gateware.description import Description
from boresight.gateware.registers import Access, BitField, Register
from boresight.model.words.fixed import wrap

_READ, _WRITE, _BOTH = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE
#: A register of each kind.
REGISTERS = Description(
    "board",
    "",
    32,
    (0, 0),
    (
        Register("clock_hz", 1026, _READ, "", width=32, reset=50_000_000),
        Register("filter", 1041, _BOTH, "", width=2, reset=0, names=("slow", "fast")),
        Register(
            "gain",
            3,
            _WRITE,
            "",
            unit="1/s",
            frac=30,
            low=-1.0,
            high=1.0,
            minimum=-(2**30),
            maximum=2**30,
        ),
        Register("temperature", 1038, _READ, "", unit="0.0678 degC", width=16, signed=True),
        Register("result_pitch", 1296, _READ, "", unit="ht", frac=31, width=32, signed=True),
        Register(
            "flags",
            1033,
            _READ,
            "",
            width=8,
            fields=(BitField("running", 0, ""), BitField("rate", 4, "", width=3)),
        ),
    ),
    (),
)


def words_of(number: int, stamp: int, *, heading: int = 1 << 29, filter: int = 0) -> list[int]:
    """Words of an update."""
    return [
        number | filter << 16 | 1 << 19,
        stamp,
        1 << 28,
        -(1 << 27),
        heading,
        1 << 29,
        0,
        0,
        0,
        3 << 23,
    ]


def frames(numbers: Iterable[int], *, step: int = 100_000) -> bytes:
    """Frames of updates of these numbers."""
    return b"".join(
        encode(Kind.ATTITUDE, words_of(n % 65536, wrap(n * step, 32)), word=32) for n in numbers
    )


class SerialBoard:
    """The other end of a port: answers accesses from a dict, sends attitudes.

    After three writes it sends what a host heard instead, if there is a ``capture``.
    """

    def __init__(
        self, words: dict[int, int], *, deaf: int = 0, noise: bytes = b"", capture: bytes = b""
    ) -> None:
        self.capture = capture
        self.words, self.deaf, self.noise = words, deaf, noise
        self.written: list[tuple[int, int]] = []
        self._master, slave = os.openpty()
        self.port = os.ttyname(slave)
        self._slave, self._stop = slave, threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        decoder, number = Decoder(word=32), 0
        os.set_blocking(self._master, False)
        while not self._stop.wait(0.005):
            number += 8
            if self.capture and len(self.written) >= 3:
                os.write(self._master, self.capture[:300])
                self.capture = self.capture[300:] or bytes([END])
            else:
                os.write(self._master, frames([number]) + self.noise)
            try:
                data = os.read(self._master, 4096)
            except BlockingIOError:
                continue
            for kind, words in decoder.feed(data):
                if self.deaf:
                    self.deaf -= 1
                    continue
                if kind is Kind.WRITE:
                    self.words[words[0]] = words[1]
                    self.written.append((words[0], words[1]))
                    os.write(self._master, encode(kind, words[:1], word=32))
                else:
                    os.write(
                        self._master, encode(kind, [wrap(self.words.get(words[0], 0), 32)], word=32)
                    )

    def __enter__(self) -> SerialBoard:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)
