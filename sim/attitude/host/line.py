"""The host side of a board's serial line: attitudes, replies, register accesses."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from boresight.gateware.attitude.system.attitude_frame import (
    FORMATS,
    OUTPUTS,
    SENSED_WORDS,
    WORDS,
    Update,
    attitude_of,
    filter_of,
    sensed_of,
    values_of,
)
from boresight.gateware.boards.frames import END, Decoder, Kind, encode
from boresight.gateware.description import Description, Records
from boresight.gateware.registers.model import Access, Register
from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.model.tools.typed import Malformed
from boresight.sim.records.reading import kind_of, read_json, reason

#: Timeout of a reply, s, and number of tries.
_ANSWER_S, _TRIES = 0.5, 3
#: Maximum length of a frame, bytes.
_FRAME_MAX = 256


@dataclass(frozen=True)
class Reply:
    """Reply to a register access: the address written, or the word read."""

    kind: Kind
    word: int


class Listener:
    """Decoder of a board's bytes: attitudes in frames, and replies.

    Parameters
    ----------
    formats : mapping
        Fraction bits of quaternion and status by filter (`attitude_frame.FORMATS`).
    other_outputs : mapping, optional
        Fraction bits by name, for estimators by number whose outputs are not an attitude.

    Attributes
    ----------
    error_count : int
        Number of frames that were damaged or of another kind, without the very first piece, which
        may be incomplete.
    """

    def __init__(
        self,
        formats: Mapping[int, tuple[int, int]] = FORMATS,
        other_outputs: Mapping[int, Mapping[str, int]] | None = None,
    ) -> None:
        self.formats, self.other_outputs = formats, other_outputs or {}
        self.error_count = 0
        self._begun = False
        self._piece = bytearray()

    def feed(self, data: bytes) -> Iterator[Update | Reply]:
        """Yield the updates and replies whose last byte is in ``data``."""
        for byte in data:
            self._piece.append(byte)
            if byte != END and len(self._piece) <= _FRAME_MAX:
                continue
            piece = bytes(self._piece)
            self._piece.clear()
            if piece == bytes([END]):
                self._begun = True
                continue
            item = self._frame(piece)
            self.error_count += item is None and self._begun
            self._begun = True
            if item is not None:
                yield item

    def _frame(self, piece: bytes) -> Update | Reply | None:
        for kind, words in Decoder(word=32).feed(piece):
            if kind is Kind.SENSED and len(words) > SENSED_WORDS:
                update = self._update(words[:-SENSED_WORDS])
                return None if update is None else replace(update, sensed=sensed_of(words))
            if kind is Kind.ATTITUDE and words:
                return self._update(words)
            if kind in (Kind.READ, Kind.WRITE) and len(words) == 1:
                return Reply(kind, words[0])
        return None

    def _update(self, words: Sequence[int]) -> Update | None:
        """The update of header, stamp and outputs; None if there are not as many as it has."""
        outputs = self.other_outputs.get(filter_of(words[0] >> 16))
        if outputs is not None and len(words) == 2 + len(outputs):
            return values_of(words, outputs)
        if outputs is None and len(words) == len(WORDS):
            return attitude_of(words, self.formats)
        return None


#: Description of a register map for messages.
_WANTED = "a registers.json of `boresight compile`"


class RegisterTable:
    """Registers by name, from a register map; or by address, without one.

    Raises
    ------
    InputError
        The file cannot be read, or is not a register map; the message gives the location.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        self.path = path
        self.described: Description | None = None
        self.programs: tuple[Records, ...] = ()
        registers: tuple[Register, ...] = ()
        if path is not None:
            try:
                self.described = described = Description.from_json(read_json(path, _WANTED))
                registers, self.programs = described.registers, described.programs
                if self._clock_of(registers) < 1:
                    raise Malformed(", clock_hz", 0)
            except Malformed as error:
                kind = kind_of(error.value)
                raise InputError.at(
                    f"{path}{error.location}",
                    wanted=_WANTED,
                    found=f"{kind} there" if error.location else kind,
                    fix="give the file of this board's bitstream",
                ) from None
        self._by_name = {r.name: r for r in registers}
        self.clock_hz = self._clock_of(registers)

    @staticmethod
    def _clock_of(registers: Sequence[Register]) -> float:
        """Clock of the system, Hz; 100 MHz if the map lacks the register."""
        resets = [r.reset for r in registers if r.name == "clock_hz" and r.reset is not None]
        return float(resets[0]) if resets else 100e6

    @property
    def formats(self) -> Mapping[int, tuple[int, int]]:
        """Fraction bits of quaternion and status by filter, as in `FORMATS`."""
        formats = {}
        for number, outputs in self._outputs.items():
            if {"qw", "status"} <= outputs.keys():
                formats[number] = (outputs["qw"], outputs["status"])
        return formats or FORMATS

    @property
    def other_outputs(self) -> dict[int, dict[str, int]]:
        """Fraction bits of outputs by name, for estimators by number without an attitude."""
        return {k: outputs for k, outputs in self._outputs.items() if tuple(outputs) != OUTPUTS}

    @property
    def _outputs(self) -> dict[int, dict[str, int]]:
        return {k: {w.name: w.frac for w in p.outputs} for k, p in enumerate(self.programs)}

    def find(self, name: str) -> Register:
        """Return the register with a name or address.

        Raises
        ------
        InputError
            No such register.
        """
        if name in self._by_name:
            return self._by_name[name]
        either = "an address, or a name and --map registers.json"
        wanted = f"a register of {self.path}" if self.path else either
        address, shown = -1, repr(name)
        with suppress(ValueError):
            address, wanted, shown = int(name, 0), "an address from 0 to 4095", name
        if not 0 <= address < 4096:
            raise InputError.at(
                f"register {name}",
                wanted=wanted,
                found=shown,
                fix="registers.json of the bitstream lists them",
            )
        for register in self._by_name.values():
            if register.address == address:
                return register
        return Register(name, address, Access.READ_WRITE, "")


def word_of(register: Register, text: str) -> int:
    """Convert a value to a word: a number in the register's unit, or one of its names.

    Raises
    ------
    InputError
        The register cannot hold the value.
    """
    where = f"--write {register.name}"
    if register.access is Access.READ_ONLY:
        raise InputError.at(
            where, wanted="a register that can be written", found="read-only", fix="choose another"
        )
    if text in register.names:
        return register.names.index(text)
    scale = 1.0 if register.frac is None else 2.0**-register.frac
    try:
        word = int(text, 0) if register.frac is None else round(float(text) / scale)
    except (ValueError, OverflowError):
        raise InputError.at(
            where,
            wanted=" or ".join(["a number", *register.names]),
            found=repr(text),
            fix="give such a value",
        ) from None
    low, high = _range_of(register)
    if not low <= word <= high:
        raise InputError.at(
            where,
            wanted=f"{low * scale:g} to {high * scale:g}",
            found=text,
            fix="give a value inside the range",
        )
    return word


def _range_of(register: Register) -> tuple[int, int]:
    """Least and largest word; without a map, of both the signed and the unsigned reading."""
    if register.minimum is not None and register.maximum is not None:
        return register.minimum, register.maximum
    bits = register.width or 32
    low = -(1 << bits - 1) if register.signed or register.width is None else 0
    if register.names:
        return low, len(register.names) - 1
    return low, (1 << bits - bool(register.signed)) - 1


def value_of(register: Register, word: int) -> Any:
    """Value of a word: a number in the register's unit, a name, or fields."""
    width = register.width or 32
    bits = word & (1 << width) - 1
    if register.signed and bits >> width - 1:
        bits -= 1 << width
    if register.fields:
        return {field.name: field.of(bits) for field in register.fields}
    if 0 <= bits < len(register.names):
        return register.names[bits]
    return bits if register.frac is None else bits * 2.0**-register.frac


def _serial(source: str, baud: int) -> Any:
    """Open a serial port; the text of an OSError is fit for a message."""
    import termios

    serial = optional("serial")
    try:
        return serial.Serial(source, baud, timeout=0.05)
    except (serial.SerialException, termios.error) as error:
        number = getattr(error, "errno", None)
        raise OSError(
            number, os.strerror(number) if number else "a device that is not a serial port"
        ) from error
    except (ValueError, OverflowError) as error:
        raise OSError(0, f"no rate of {baud} there") from error


def _capture(source: str, _: int) -> Any:
    return Path(source).open("rb")


class BoardLine:
    """A serial port, or a file of bytes captured from one.

    Parameters
    ----------
    source : str
        Port or file.
    baud : int
        Bits per second.
    listener : Listener
        Decoder of the bytes.

    Raises
    ------
    InputError
        The port or file cannot be opened.
    """

    def __init__(self, source: str, *, baud: int, listener: Listener) -> None:
        self.source, self.listener = source, listener
        try:
            mode = Path(source).stat().st_mode
            self.is_port = not stat.S_ISREG(mode)
            if self.is_port and not stat.S_ISCHR(mode):
                raise OSError(0, "a folder" if stat.S_ISDIR(mode) else "neither of them")
            opened = _serial if self.is_port else _capture
            self._file = opened(source, baud)
        except OSError as error:
            raise InputError.at(
                source or "''",
                wanted="a serial port, or a file of captured bytes",
                found=reason(error),
                fix="name a device that exists and may be opened, at a rate that it has",
            ) from error

    def __enter__(self) -> BoardLine:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def items(self, *, silence_s: float) -> Iterator[Update | Reply]:
        """Yield updates and replies, until the file ends.

        Raises
        ------
        InputError
            No update or reply came for ``silence_s``, or the port is gone.
        """
        understood, heard = time.monotonic(), 0
        while True:
            data = self._read()
            heard += len(data)
            for item in self.listener.feed(data):
                understood, heard = time.monotonic(), 0
                yield item
            if not data and not self.is_port:
                return
            if self.is_port and time.monotonic() - understood > silence_s:
                raise InputError.at(
                    self.source,
                    wanted="attitudes from the board",
                    found=f"{heard:,} other bytes" if heard else f"none for {silence_s:g} s",
                    fix="check wiring and power, --baud, and register output_mode",
                )

    def access(
        self,
        kind: Kind,
        words: list[int],
        *,
        also: Callable[[Update], object] = lambda attitude: None,
    ) -> int:
        """Send a register access and wait for its reply; attitudes meanwhile go to ``also``.

        Raises
        ------
        InputError
            Not a port, or no reply.
        """
        if not self.is_port:
            raise InputError.at(
                self.source,
                wanted="a serial port to read or write registers",
                found="a file",
                fix="name the port",
            )
        for _ in range(_TRIES):
            self._send(bytes([END]) + encode(kind, words, word=32))
            end = time.monotonic() + _ANSWER_S
            while time.monotonic() < end:
                answer = None
                for item in self.listener.feed(self._read()):
                    if isinstance(item, Update):
                        also(item)
                    elif item.kind is kind and (kind is Kind.READ or item.word == words[0]):
                        answer = item.word
                if answer is not None:
                    return answer
        raise InputError.at(
            self.source,
            wanted="an answer from the board",
            found=f"none in {_TRIES} tries",
            fix="check the line to the board, and --baud",
        )

    def _read(self) -> bytes:
        try:
            if not self.is_port:
                return bytes(self._file.read(65536))
            return bytes(self._file.read(max(1, self._file.in_waiting)))
        except OSError as error:
            raise self._gone(error) from error

    def _send(self, data: bytes) -> None:
        try:
            self._file.write(data)
        except OSError as error:
            raise self._gone(error) from error

    def _gone(self, error: OSError) -> InputError:
        return InputError.at(
            self.source, wanted="a line that stays", found=str(error), fix="plug the board in again"
        )
