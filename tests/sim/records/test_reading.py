"""Files that people name: what is read, and the one line about what is not."""

from __future__ import annotations

import errno
import os
import threading
from pathlib import Path

import pytest

from boresight.model.errors import InputError
from boresight.sim.records import reading
from boresight.sim.records.reading import kind_of, read_bytes, read_json, reason


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (IsADirectoryError(errno.EISDIR, "Is a directory"), "a folder"),
        (PermissionError(errno.EACCES, "Permission denied"), "permission denied"),
        (OSError(0, "no rate of 7 there"), "no rate of 7 there"),
        (OSError(), "oserror"),
    ],
)
def test_reasons(error: OSError, words: str) -> None:
    assert reason(error) == words


def test_files_and_pipes(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"\0\xff")
    assert read_bytes(tmp_path / "file", "a file") == b"\0\xff"
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(target=lambda: (tmp_path / "pipe").write_bytes(b"text"))
    writer.start()
    assert read_bytes(tmp_path / "pipe", "a file") == b"text"
    writer.join()


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("/dev/zero", "/dev/zero: wanted a log, found a device"),
        ("none", "none: wanted a log, found no such file or directory"),
        (".", ".: wanted a log, found a folder"),
        ("", "'': wanted a log, found no such file or directory"),
    ],
)
def test_what_cannot_be_read(name: str, found: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{found}; check the path$"):
        read_bytes(name, "a log")


@pytest.fixture
def json_of(tmp_path: Path):
    def read(content: bytes) -> object:
        (tmp_path / "x.json").write_bytes(content)
        return read_json(tmp_path / "x.json", "a map")

    return read


def test_json(json_of) -> None:
    assert json_of(b'\xef\xbb\xbf{"a": [1, 2.5, null, true, "\\u00fc"]}') == {
        "a": [1, 2.5, None, True, "ü"]
    }
    assert json_of(b"1" * 100) == int("1" * 100)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"", "an empty file"),
        (b" \n", "an empty file"),
        (b"\0\0", "no JSON in line 1, column 1"),
        (b"{\n 1}", "no JSON in line 2, column 2"),
        (b"\xff", "bytes that are no UTF-8 text"),
        (b"[NaN]", "NaN, which JSON does not have"),
        (b"[-Infinity]", "-Infinity, which JSON does not have"),
        (b'{"a": 1, "a": 1}', "'a' twice"),
        (b"1" * 101, "a number of 101 digits"),
        (b"[" * 100_000, "lists or objects nested too deeply"),
    ],
)
def test_what_is_no_json(content: bytes, found: str, json_of) -> None:
    with pytest.raises(InputError, match=f"x.json: wanted a map, found {found}; correct the file$"):
        json_of(content)


def test_a_file_may_be_too_large(json_of, monkeypatch) -> None:
    monkeypatch.setattr(reading, "_JSON_MOST", 1000)
    assert json_of(b" " * 999 + b"1") == 1
    with pytest.raises(InputError, match="found 1,001 bytes"):
        json_of(b" " * 1000 + b"1")


def test_kinds() -> None:
    values = (None, True, 3, 2.5, "a", [1], {"a": 1})
    assert [kind_of(v) for v in values] == [
        *("nothing", "true", "3", "2.5", "'a'", "a list", "an object")
    ]
