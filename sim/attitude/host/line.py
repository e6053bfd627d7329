"""The host side of a board's serial line: attitudes, replies, register accesses."""

from __future__ import annotations

import io
import os
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from boresight.gateware.attitude.system import interface
from boresight.gateware.boards.frames import END, Decoder, Kind, encode
from boresight.gateware.description import Description
from boresight.gateware.registers import Access, Register
from boresight.model.errors import InputError, require
from boresight.model.tools.external import optional
from boresight.model.tools.reading import Malformed, kind_of, read_json, reason, typed
from boresight.model.words.fixed import wrap

#: Timeout of a reply, s, and number of tries.
_ANSWER_S, _TRIES = 0.5, 3


class Reply(NamedTuple):
    """Reply to a register access: the address written, or the word read."""

    kind: Kind
    word: int


class Listener:
    """Decoder of a board's bytes: updates in frames, and replies.

    ``formats`` are fraction bits of outputs by name, by the number of the estimator.
    """

    def __init__(self, formats: Mapping[int, Mapping[str, int]] = interface.FORMATS) -> None:
        self.formats, self._decoder, self._others = formats, Decoder(word=32), 0
        self._begun = False

    @property
    def error_count(self) -> int:
        """Frames damaged or of another kind, without the first piece, which may be incomplete."""
        return self._decoder.dropped + self._others

    def feed(self, data: bytes) -> Iterator[interface.Update | Reply]:
        """Yield the updates and replies whose last byte is in ``data``."""
        if not self._begun:
            data = data[data.find(END) :] if END in data else b""
            self._begun = bool(data)
        for kind, words in self._decoder.feed(data):
            item = self._item(kind, words)
            self._others += item is None
            if item is not None:
                yield item

    def _item(self, kind: Kind, words: list[int]) -> interface.Update | Reply | None:
        if kind in (Kind.READ, Kind.WRITE) and len(words) == 1:
            return Reply(kind, words[0])
        count = len(words) - (interface.SENSED_WORDS if kind is Kind.SENSED else 0)
        if kind < Kind.ATTITUDE or count < 2:
            return None
        outputs = self.formats.get(interface.FIELDS["filter"].of(words[0]))
        if count != (len(interface.WORDS) if outputs is None else 2 + len(outputs)):
            return None
        sensed = interface.sensed_of(words) if kind is Kind.SENSED else None
        return interface.update_of(words, interface.ANGLES if outputs is None else outputs, sensed)


#: Description of a register map for messages.
_WANTED = "a registers.json of `boresight compile`"


class RegisterTable:
    """Registers by name, from a register map; or by address, without one.

    ``formats`` are those of a `Listener`; ``clock_hz`` is 100 MHz if the map lacks the register.

    `InputError`: the file cannot be read, or is not a register map; the message gives the location.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        self.path = path
        self.described: Description | None = None
        self.formats: Mapping[int, Mapping[str, int]] = interface.FORMATS
        self.clock_hz = 100e6
        if path is None:
            return
        try:
            described = self.described = typed(Description, read_json(path, _WANTED))
            for register in described.registers:
                if register.name == "clock_hz" and register.reset is not None:
                    self.clock_hz = float(register.reset)
            if self.clock_hz < 1:
                raise Malformed(", clock_hz", 0)
        except Malformed as error:
            kind = kind_of(error.value)
            raise InputError.at(
                f"{path}{error.location}",
                wanted=_WANTED,
                found=f"{kind} there" if error.location else kind,
                fix="give the file of this board's bitstream",
            ) from None
        if described.programs:
            outputs = [{w.name: w.frac for w in p.outputs} for p in described.programs]
            self.formats = dict(enumerate(outputs))

    def find(self, name: str) -> Register:
        """Return the register with a name or address."""
        registers = self.described.registers if self.described else ()
        for register in registers:
            if register.name == name:
                return register
        either, fix = "an address, or a name and --map registers.json", "registers.json lists them"
        wanted, address = f"a register of {self.path}" if self.path else either, -1
        with suppress(ValueError):
            address, wanted = int(name, 0), "an address from 0 to 4095"
        require(0 <= address < 4096, f"register {name}", wanted, name, fix)
        of_map = (register for register in registers if register.address == address)
        return next(of_map, Register(name, address, Access.READ_WRITE, ""))


def word_of(register: Register, text: str) -> int:
    """Convert a value to a word: a number in the register's unit, or one of its names."""
    where = f"--write {register.name}"
    good, found = register.access is not Access.READ_ONLY, "one that can be read only"
    require(good, where, "a register that can be written", found, "choose another")
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
    # Without a map, a word of the signed and of the unsigned reading.
    bits = register.width or 32
    low = -(1 << bits - 1) if register.signed or register.width is None else 0
    high = len(register.names) - 1 if register.names else (1 << bits - bool(register.signed)) - 1
    if register.minimum is not None and register.maximum is not None:
        low, high = register.minimum, register.maximum
    wanted, fix = f"{low * scale:g} to {high * scale:g}", "give a value inside the range"
    value = word if register.frac is None else word * scale
    require(low <= word <= high, where, wanted, value, fix)
    return word


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
        text = os.strerror(number) if number else "a device that is not a serial port"
        raise OSError(number, text) from error
    except (ValueError, OverflowError) as error:
        raise OSError(0, f"no rate of {baud} there") from error


class BoardLine:
    """A serial port, or a file of bytes captured from one.

    `InputError`: the port or file cannot be opened.
    """

    def __init__(self, source: str, *, baud: int, listener: Listener) -> None:
        self.source, self.listener = source, listener
        try:
            mode = Path(source).stat().st_mode
            self.is_port = not stat.S_ISREG(mode)
            if self.is_port and not stat.S_ISCHR(mode):
                raise OSError(0, "a folder" if stat.S_ISDIR(mode) else "neither of them")
            data = b"" if self.is_port else Path(source).read_bytes()
            self._file: Any = _serial(source, baud) if self.is_port else io.BytesIO(data)
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

    def items(self, *, silence_s: float) -> Iterator[interface.Update | Reply]:
        """Yield updates and replies, until the file ends.

        `InputError`: no update or reply came for ``silence_s``, or the port is gone.
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
            silent = self.is_port and time.monotonic() - understood > silence_s
            found = f"{heard:,} other bytes" if heard else f"none for {silence_s:g} s"
            fix = "check wiring and power, --baud, and register output_mode"
            require(not silent, self.source, "attitudes from the board", found, fix)

    def access(self, kind: Kind, words: list[int]) -> int:
        """Send a register access and wait for its reply; updates meanwhile are dropped.

        `InputError`: not a port, or no reply.
        """
        wanted = "a serial port to read or write registers"
        require(self.is_port, self.source, wanted, "a file", "name the port")
        own = words[0] if kind is Kind.WRITE else None
        for _ in range(_TRIES):
            with self._present():
                self._file.write(bytes([END]) + encode(kind, [wrap(w, 32) for w in words], word=32))
            end = time.monotonic() + _ANSWER_S
            while time.monotonic() < end:
                answer = None
                for item in self.listener.feed(self._read()):
                    if isinstance(item, Reply) and item.kind is kind and own in (None, item.word):
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
        with self._present():
            size = max(1, self._file.in_waiting) if self.is_port else 65536
            return bytes(self._file.read(size))

    @contextmanager
    def _present(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputError.at(
                self.source,
                wanted="a port that stays connected",
                found=str(error),
                fix="plug the board in again",
            ) from error
