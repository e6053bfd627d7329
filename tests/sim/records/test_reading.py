"""Files that people name: bytes, strict JSON, and one line where it is none."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.sim.records.reading import kind_of, read_bytes, read_json

pytestmark = pytest.mark.pythons


def test_bytes(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\0x")
    assert read_bytes(tmp_path / "a", "a file") == b"\0x"
    for path, found in ((tmp_path, "a folder"), (tmp_path / "b", "no such file or directory"),
                        ("/dev/zero", "a device")):  # fmt: skip
        with pytest.raises(InputError, match=f"^{path}: wanted a file, found {found}; check the"):
            read_bytes(path, "a file")
    with pytest.raises(InputError, match="^'': wanted a file, found no such file"):
        read_bytes("", "a file")


def test_json(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b'\xef\xbb\xbf{"a": [1, 2.5, null, "b"]}')
    assert read_json(path, "a map") == {"a": [1, 2.5, None, "b"]}


@pytest.mark.pythons
@pytest.mark.parametrize(
    "content, found",
    [
        (b"", "an empty file"),
        (b"  \n", "an empty file"),
        (b"\0\0\0", "no JSON in line 1, column 1"),
        (b"\xff\xfe", "bytes that are not UTF-8 text"),
        (b'{"a": 1\n b}', "no JSON in line 2, column 2"),
        (b"[NaN]", "NaN, which JSON does not have"),
        (b"[-Infinity]", "-Infinity, which JSON does not have"),
        (b'{"a": 1, "a": 2}', "'a' twice"),
        (b"1" * 101, "a number of 101 digits"),
        (b"[" * 100_000, "lists or objects nested too deeply"),
    ],
)
def test_what_is_no_json(tmp_path: Path, content: bytes, found: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    message = f"{path}: wanted a map, found {found}; correct the file"
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        read_json(path, "a map")


@pytest.mark.parametrize(
    "value, said",
    [(None, "nothing"), (True, "true"), (2.5, "2.5"), ("x", "'x'"), ([], "a list"), ({}, "an obj")],
)
def test_kinds(value: Any, said: str) -> None:
    assert kind_of(value).startswith(said)
