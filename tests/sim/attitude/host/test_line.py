"""The host's end of the line: what the bytes say, registers by name, values as words."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest

import boresight
from boresight.gateware.attitude.system.interface import FORMATS, Update
from boresight.gateware.boards.frames import END, Kind, encode
from boresight.gateware.description import Records, Word
from boresight.gateware.registers import Access, BitField, Register
from boresight.model.errors import InputError
from boresight.sim.attitude.host.line import (
    BoardLine,
    Listener,
    RegisterTable,
    Reply,
    value_of,
    word_of,
)
from tests.support.attitude.serial_board import REGISTERS, SerialBoard, frames


def register(**fields) -> Register:
    usual = {"name": "r", "address": 0, "access": Access.READ_WRITE, "meaning": ""}
    return Register(**{**usual, **fields})


@pytest.fixture
def table(tmp_path: Path) -> RegisterTable:
    path = tmp_path / "registers.json"
    path.write_text(REGISTERS.to_json())
    return RegisterTable(path)


def test_listener() -> None:
    """Frames and replies among damage, a byte at a time; half a frame at the start is no error."""
    reply = encode(Kind.READ, [-1], word=32)
    noise = b"nonsense\r\n" + bytes([END, END]) + b"\x02\xff\xc0" + b"\xfe" * 300 + b"\xc0"
    record = encode(Kind.RECORD, [1], word=32)
    data = b"\x03alf a frame\xc0" + frames([7, 8]) + reply + noise + frames([9]) + record
    listener = Listener()
    items = [item for k in range(len(data)) for item in listener.feed(data[k : k + 1])]
    assert [type(item) for item in items] == [Update, Update, Reply, Update]
    assert items[2] == Reply(Kind.READ, -1) and items[3].number == 9
    assert listener.error_count == 4  # a line, a short frame, noise, a record


def test_formats_of_a_map(table: RegisterTable, tmp_path: Path) -> None:
    assert table.clock_hz == 50e6 and table.formats == FORMATS
    programs = (Records("a", "", (), (Word("qw", 20), Word("status", 10))),)
    path = tmp_path / "other.json"
    path.write_text(dataclasses.replace(REGISTERS, programs=programs).to_json())
    assert RegisterTable(path).formats == {0: {"qw": 20, "status": 10}}
    assert RegisterTable().clock_hz == 100e6 and RegisterTable().formats == FORMATS


def test_registers_by_name_or_address(table: RegisterTable) -> None:
    assert table.find("gain").address == table.find("3").address == 3
    assert table.find("0x3").name == "gain"
    assert table.find("4095") == register(name="4095", address=4095)
    for name, entry in (
        ("-1", "found '-1'"),
        ("0x1000", "found '0x1000'"),
        ("gians", "found 'gians'"),
    ):
        with pytest.raises(InputError, match=f"^register {name}: wanted .*, {entry}; regist"):
            table.find(name)
    assert RegisterTable().find("7") == register(name="7", address=7)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "registers.json: wanted a registers.json of `boresight compile`, found a list; give"),
        ({}, "registers.json, name: wanted .*, found nothing there; give the file of this board"),
        ({"registers": [1]}, r"registers.json, registers\[0\]: wanted .*, found 1 there;"),
        ({"word": True}, "registers.json, word: wanted .*, found true there;"),
    ],
)
def test_what_is_no_register_map(data: object, message: str, tmp_path: Path) -> None:
    path = tmp_path / "registers.json"
    whole = json.loads(REGISTERS.to_json())
    path.write_text(json.dumps({**whole, **data} if isinstance(data, dict) and data else data))
    with pytest.raises(InputError, match=message):
        RegisterTable(path)


def test_a_clock_of_zero_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "registers.json"
    path.write_text(REGISTERS.to_json().replace("50000000", "0"))
    with pytest.raises(InputError, match=r"registers.json, clock_hz: wanted .*, found 0 there;"):
        RegisterTable(path)


@pytest.mark.parametrize(
    ("fields", "text", "word"),
    [
        ({"width": 8}, "255", 255),
        ({"width": 8, "signed": True}, "-128", -128),
        ({"frac": 4}, "-1.55", -25),
        ({"frac": -4}, "1e3", 62),
        ({}, "0x7fffffff", 2**31 - 1),
        ({}, "0xffffffff", 2**32 - 1),
        ({}, "-2147483648", -(2**31)),
        ({"width": 2, "names": ("slow", "fast")}, "fast", 1),
        ({"width": 2, "names": ("slow", "fast")}, "0", 0),
        ({"minimum": -5, "maximum": 5}, "-5", -5),
    ],
)
def test_words_of_values(fields: dict, text: str, word: int) -> None:
    assert word_of(register(**fields), text) == word


@pytest.mark.parametrize(
    ("fields", "text", "message"),
    [
        ({"width": 8}, "256", "wanted 0 to 255, found 256"),
        ({"width": 8}, "-1", "wanted 0 to 255, found -1"),
        ({"width": 8, "signed": True}, "-129", "wanted -128 to 127, found -129"),
        ({"width": 8, "signed": True}, "128", "wanted -128 to 127, found 128"),
        ({"frac": 1, "minimum": -4, "maximum": 4}, "2.5", "wanted -2 to 2, found 2.5"),
        ({"width": 2, "names": ("slow", "fast")}, "2", "wanted 0 to 1, found 2"),
        ({"names": ("slow",)}, "fast", "wanted a number or slow, found 'fast'"),
        ({"frac": 4}, "inf", "wanted a number, found 'inf'"),
        ({"frac": 4}, "nan", "wanted a number, found 'nan'"),
        ({}, "1.5", "wanted a number, found '1.5'"),
        (
            {"access": Access.READ_ONLY},
            "1",
            "wanted a register that can be written, found one that can be read only",
        ),
    ],
)
def test_values_that_no_word_is(fields: dict, text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"^--write r: {re.escape(message)}; "):
        word_of(register(**fields), text)


@pytest.mark.parametrize(
    ("fields", "word", "value"),
    [
        ({}, 0xFFFFFFFF, 0xFFFFFFFF),
        ({"width": 8}, 0x1FF, 0xFF),
        ({"width": 8, "signed": True}, 0x80, -128),
        ({"width": 8, "signed": True}, 0x7F, 127),
        ({"frac": 4, "signed": True}, 2**32 - 8, -0.5),
        ({"names": ("slow", "fast")}, 1, "fast"),
        ({"names": ("slow", "fast")}, 2, 2),
        ({"fields": (BitField("a", 4, "", width=3),)}, 0xF5F, {"a": 5}),
    ],
)
def test_values_of_words(fields: dict, word: int, value: object) -> None:
    assert value_of(register(**fields), word) == value


def test_only_the_answer_to_this_write_counts() -> None:
    other = encode(Kind.WRITE, [999], word=32)
    with SerialBoard({}, deaf=1, noise=other) as board:
        boresight.monitor(board.port, writes=["5=77"])
        assert board.written == [(5, 77)]


def test_a_capture_is_read_to_its_end_and_written_never(tmp_path: Path) -> None:
    capture = tmp_path / "capture.bin"
    capture.write_bytes(frames([1, 2]))
    with BoardLine(str(capture), baud=9600, listener=Listener()) as line:
        items = list(line.items(silence_s=0.0))
        assert all(isinstance(item, Update) for item in items) and len(items) == 2
        with pytest.raises(InputError, match="wanted a serial port to read or write .* a file;"):
            line.access(Kind.READ, [5])


@pytest.mark.parametrize(
    ("source", "reason"), [("", "a folder"), (".", "a folder"), ("none", "no such file")]
)
def test_what_is_no_line(source: str, reason: str) -> None:
    with pytest.raises(InputError, match=f"wanted a serial port, or a file of .*, found {reason}"):
        BoardLine(source, baud=9600, listener=Listener())
