"""Locks on folders: alone or shared, gone with their object or their process."""

from __future__ import annotations

import errno
import fcntl
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.disk.locks import lock_folder

HOLD = """
import sys; from pathlib import Path; from boresight.disk.locks import lock_folder
held = lock_folder(Path(sys.argv[1])); print("held", flush=True); sys.stdin.read()
"""


def test_alone_or_shared(tmp_path: Path) -> None:
    alone = lock_folder(tmp_path)
    assert alone is not None
    assert lock_folder(tmp_path) is None and lock_folder(tmp_path, shared=True) is None
    alone.release()
    first, second = (lock_folder(tmp_path, shared=True) for _ in range(2))
    assert first is not None and second is not None and lock_folder(tmp_path) is None
    first.release()
    assert lock_folder(tmp_path) is None
    second.release()
    assert lock_folder(tmp_path) is not None


def test_the_end_of_the_object_releases(tmp_path: Path) -> None:
    held = lock_folder(tmp_path)
    assert held is not None
    del held
    with lock_folder(tmp_path) or pytest.fail("not free"):
        assert lock_folder(tmp_path) is None
    assert lock_folder(tmp_path) is not None


def test_a_killed_process_releases(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        assert lock_folder(tmp_path) is None
        process.kill()
        assert lock_folder(tmp_path, wait=True) is not None


def test_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for name in ("none", "file"):
        with pytest.raises(OSError):
            lock_folder(tmp_path / name)


def test_without_locks_no_folder_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(descriptor: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "no locks here")

    monkeypatch.setattr(fcntl, "flock", refuse)
    assert lock_folder(tmp_path) is None
    assert lock_folder(tmp_path, shared=True) is not None
    assert lock_folder(tmp_path, wait=True) is not None
