"""Places of results: what they are, whether they may be written, and how they are shown.

`tests/boresight/test_files.py` tries every verb on every kind of place.
"""

from __future__ import annotations

import errno
import os
import socket
from pathlib import Path

import pytest

from boresight.disk import manifest
from boresight.disk.clear import clear
from boresight.disk.output import OutputFile
from boresight.disk.paths import (
    absolute,
    created_folders,
    descriptor_of,
    is_stream,
    refusal,
    refuse_inputs,
    require_folder,
    require_no_circle,
    require_open,
    require_open_stream,
    require_ours,
    same_file,
    shown,
)
from boresight.model.errors import InputError


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_paths_for_people(here: Path) -> None:
    assert shown(here / "a" / "b") == os.path.join("a", "b")
    assert shown(here) == str(here) and shown("/etc/x") == "/etc/x"
    assert shown(f"{here}-more/x") == f"{here}-more/x"


def test_the_last_link_is_not_followed(here: Path) -> None:
    (here / "real").mkdir()
    (here / "folder").symlink_to("real")
    (here / "real" / "link").symlink_to("elsewhere")
    assert absolute("folder/link", "-o") == (here / "real" / "link").resolve().parent / "link"
    for text in ("", "  "):
        with pytest.raises(InputError, match="^-o: wanted a name, found an empty one; write a n"):
            absolute(text, "-o")


@pytest.mark.parametrize(
    ("path", "number"),
    [
        ("/dev/stdout", 1),
        ("/dev/stderr", 2),
        ("/dev/fd/17", 17),
        ("/proc/self/fd/3", 3),
        ("/dev//fd/./4", 4),
        ("/dev/stdin", None),
        ("/dev/fd/x", None),
        ("/dev/fd/1/2", None),
        ("stdout", None),
    ],
)
def test_open_files_by_name(path: str, number: int | None) -> None:
    assert descriptor_of(path) == number


def test_what_is_written_through(here: Path) -> None:
    os.mkfifo("fifo")
    Path("file").touch()
    assert [is_stream(Path(p), "-o") for p in ("fifo", os.devnull)] == [True, True]
    assert [is_stream(Path(p), "-o") for p in ("file", "none")] == [False, False]
    Path("folder").mkdir()
    with socket.socket(socket.AF_UNIX) as end:
        end.bind("socket")
    for name in ("folder", "socket"):
        with pytest.raises(InputError, match=f"^{name}: wanted the name of a file, found a {name}"):
            is_stream(Path(name), "-o")


def test_only_what_boresight_wrote_is_overwritten(here: Path) -> None:
    require_ours(here / "none", "-o")
    OutputFile(here / "ours", "run").write("text")
    require_ours(here / "ours", "-o")
    (here / "link").symlink_to("ours")
    require_ours(here / "link", "-o")
    (here / "ours").chmod(0o444)
    with pytest.raises(
        InputError, match="^ours: wanted a file that can be written, found a write-"
    ):
        require_ours(here / "ours", "-o")
    (here / "ours").chmod(0o466)  # any of the three permissions will do
    require_ours(here / "ours", "-o")
    (here / "ours").chmod(0o644)
    (here / "ours").write_text("edited")
    (here / "users").touch()
    for name in ("ours", "users"):
        with pytest.raises(
            InputError, match=f"^{name}: wanted a free name, or .* found a file .*-o"
        ):
            require_ours(here / name, "-o")


def test_what_cannot_be_read_is_not_overwritten(here: Path, monkeypatch) -> None:
    """Its owner may have forbidden it; root reads all the same."""
    OutputFile(here / "ours", "run").write("text")

    def unreadable(path: Path) -> str:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(manifest, "digest", unreadable)
    with pytest.raises(InputError, match="^ours: wanted a free .* a file that cannot be read;"):
        require_ours(here / "ours", "-o")
    assert (here / "ours") in clear(here) and (here / "ours").exists()


def test_folders_and_links_that_hold_no_file(here: Path) -> None:
    require_folder(here / "none")
    require_folder(here)
    (here / "file").touch()
    with pytest.raises(OSError, match="a file 'file' where a folder must be"):
        require_folder(here / "file")
    (here / "good").symlink_to("none")
    require_no_circle(here / "good")
    require_no_circle(here / "file")
    for name, target, number in (("self", "self", errno.ELOOP), ("lost", "no/x", errno.ENOENT)):
        (here / name).symlink_to(target)
        with pytest.raises(OSError) as failed:
            require_no_circle(here / name)
        assert failed.value.errno == number


def test_open_for_writing(here: Path) -> None:
    with open("file", "w") as writes, open("file") as reads:
        require_open(writes.fileno())
        with pytest.raises(OSError, match="not open for writing"):
            require_open(reads.fileno())
    require_open_stream(Path(os.devnull))


def test_one_file_by_two_names(here: Path) -> None:
    Path("a").touch()
    Path("c").touch()
    os.link("a", "b")
    Path("link").symlink_to("a")
    assert same_file("a", "b") and same_file("link", here / "a")
    assert not same_file("a", "c") and not same_file("a", "none") and not same_file("", "a")
    assert not same_file("a", "a\0")
    # Nothing is lost where nothing is kept.
    assert not same_file(os.devnull, os.devnull) and same_file("/dev/zero", "/dev/zero")
    refuse_inputs("a", ["c", "none"], "-o")
    with pytest.raises(
        InputError, match="^b: wanted an output .* the same file as the input link;"
    ):
        refuse_inputs("b", ["c", "link"], "--csv")


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.EACCES, "Permission denied"), "permission denied"),
        (OSError(), "OSError"),
        (ValueError("embedded null byte"), "embedded null byte"),
    ],
)
def test_refusals(error: OSError | ValueError, reason: str) -> None:
    text = str(refusal("x", error, "--csv"))
    assert text.startswith(f"x: wanted a path that can be written, found {reason}; choose another ")
    assert "with --csv" in text


@pytest.mark.parametrize(
    ("keep", "fails", "left"),
    [
        (True, False, {"old", "old/new", "old/new/deep"}),
        (False, False, {"old"}),
        (True, True, {"old"}),
    ],
)
def test_folders_for_a_while(keep: bool, fails: bool, left: set[str], here: Path) -> None:
    (here / "old").mkdir()
    try:
        with created_folders(here / "old" / "new" / "deep", keep=keep):
            assert (here / "old" / "new" / "deep").is_dir()
            if fails:
                raise ZeroDivisionError
    except ZeroDivisionError:
        assert fails
    assert {p.relative_to(here).as_posix() for p in here.rglob("*")} == left


def test_a_folder_with_something_in_it_stays(here: Path) -> None:
    with created_folders(here / "a" / "b", keep=False):
        (here / "a" / "mine").touch()
    assert {p.name for p in here.rglob("*")} == {"a", "mine"}
    with pytest.raises(NotADirectoryError), created_folders(here / "a" / "mine"):
        pytest.fail("the block ran")
