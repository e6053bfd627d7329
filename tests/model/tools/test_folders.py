"""Caches where the home is open, closed, or not there at all."""

import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from boresight.model.tools.external import cache_folder, private_folder, yosys_environment


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A home and a temporary folder of the test's own."""
    (tmp_path / "tmp").mkdir()
    for name in ("XDG_CACHE_HOME", "YOWASP_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    private_folder.cache_clear()
    yield
    private_folder.cache_clear()


@pytest.fixture
def closed(tmp_path: Path) -> None:
    """No folder can be made in the home: not even by root."""
    (tmp_path / "home").write_text("a file")


def test_open_home(tmp_path: Path) -> None:
    assert cache_folder("boresight") == tmp_path / "home" / ".cache" / "boresight"
    assert yosys_environment() == {}
    assert not list((tmp_path / "tmp").glob("boresight-*/*"))


def test_users_cache_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "elsewhere"))
    assert cache_folder("x") == tmp_path / "elsewhere" / "x"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert cache_folder("x") == private_folder() / "x"


@pytest.mark.usefixtures("closed")
def test_closed_home(tmp_path: Path) -> None:
    private = tmp_path / "tmp" / f"boresight-{os.getuid()}"
    assert cache_folder("boresight") == private / "boresight"
    assert stat.S_IMODE(private.stat().st_mode) == 0o700
    assert yosys_environment() == {"YOWASP_CACHE_DIR": str(private / "YoWASP")}
    assert all((private / name).is_dir() for name in ("boresight", "YoWASP"))


@pytest.mark.parametrize("kind", ["link", "open to others", "file"])
def test_a_folder_of_another_user_is_not_used(tmp_path: Path, kind: str) -> None:
    expected = tmp_path / "tmp" / f"boresight-{os.getuid()}"
    if kind == "link":
        (tmp_path / "other").mkdir(mode=0o700)
        expected.symlink_to(tmp_path / "other")
    elif kind == "file":
        expected.write_text("")
        expected.chmod(0o600)
    else:
        expected.mkdir()
        expected.chmod(0o777)
    result = private_folder()
    assert result != expected and result.parent == tmp_path / "tmp"
    assert stat.S_IMODE(result.stat().st_mode) == 0o700
    assert private_folder() == result
