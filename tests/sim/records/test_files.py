"""Log files by their names: read, written, and what is no file."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.files import content_of, log_files, read_record, record_of
from boresight.sim.records.record import Column, Record

pytestmark = pytest.mark.pythons

T = np.array([0.0, 0.5, 0.75, 1.75])


def packed(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.npz", "a.NPZ"])
def test_written_and_read_back_exactly(tmp_path: Path, name: str) -> None:
    held = {"t": Column(T, "s"), "z": Column(np.array([np.nan, 0.1 + 0.2, -0.0, 1e-300]))}
    content = content_of(name, Record("r", held))
    assert content.startswith(b"PK") == name.lower().endswith(".npz")
    (tmp_path / name).write_bytes(content)
    found = read_record(tmp_path / name)
    assert found.name == "a" and [c.unit for c in found.columns.values()] == ["s", None]
    for key, column in held.items():
        assert found.columns[key].values.tobytes() == column.values.tobytes()


def test_files_by_suffix(tmp_path: Path) -> None:
    for name, content in (("a.NPZ", packed(z=[1.5])), ("b.txt", b"z\n1.5\n")):
        (tmp_path / name).write_bytes(content)
        found = read_record(str(tmp_path / name))
        assert found.name == name[0] and found.columns["z"].values.tolist() == [1.5]
    with pytest.raises(InputError, match="wanted a log file that can be read, found no such file"):
        read_record(tmp_path / "c.csv")


def test_of_paths_and_of_memory(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    path.write_text("z[m]\n1.5\n")
    for given in (path, str(path)):
        found = record_of(given)
        assert found.name == "walk"
        assert found.columns["z"].values.tolist() == [1.5] and found.columns["z"].unit == "m"
    assert record_of(found) is found and record_of({"z": [1.0]}, name="mine").name == "mine"


def test_a_folder_stands_for_its_logs(tmp_path: Path) -> None:
    for name in ("b.csv", "a.npz", "notes.txt", "deep/c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = log_files([tmp_path / "notes.txt", tmp_path])
    assert [p.relative_to(tmp_path).as_posix() for p in found] == [
        *("notes.txt", "a.npz", "b.csv", "deep/c.csv")
    ]
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: wanted a log, or a folder with .* without any; "):
        log_files([tmp_path / "empty"])
