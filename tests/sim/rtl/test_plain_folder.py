"""A folder that every tool can work in, wherever the temporary folder is."""

from __future__ import annotations

import os
import re
import stat
import tempfile
from pathlib import Path

import pytest

from boresight.model.errors import ToolMissing
from boresight.sim.rtl import plain_folder as module
from boresight.sim.rtl.plain_folder import plain_folder


@pytest.mark.parametrize("odd", ["with space", "übung", "a$b", "semi;colon", "it's"])
def test_plain_path_and_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str) -> None:
    (tmp_path / odd).mkdir()
    (tmp_path / odd / "file").write_text("content")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / odd))
    with plain_folder({"there": tmp_path / odd}) as room:
        assert re.fullmatch(r"[\w/.+-]+", os.path.realpath(room), re.ASCII)
        assert stat.S_IMODE(room.stat().st_mode) == 0o700
        assert (room / "there" / "file").read_text() == "content"
    assert not room.exists()
    assert (tmp_path / odd / "file").exists()


def test_a_link_to_an_odd_folder_is_seen_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "with space").mkdir()
    (tmp_path / "plain").symlink_to(tmp_path / "with space")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "plain"))
    with plain_folder({}) as room:
        assert " " not in os.path.realpath(room)


def test_a_plain_temporary_folder_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = tempfile.mkdtemp(prefix="plain-", dir="/tmp")
    monkeypatch.setattr(tempfile, "tempdir", plain)
    with plain_folder({}) as room:
        assert room.parent == Path(plain)
    os.rmdir(plain)


def test_none_is_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.os, "access", lambda folder, how: False)
    with pytest.raises(ToolMissing, match="set TMPDIR"), plain_folder({}):
        pass
