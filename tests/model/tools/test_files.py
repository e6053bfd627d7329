"""Files that users name; output files and the build cache, used by several processes."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from boresight.model.errors import InputError
from boresight.model.tools import files as module
from boresight.model.tools.files import Cache, OutputFile, kept, output_folder
from boresight.model.tools.reading import read_bytes, read_json


def test_an_error_in_the_work_leaves_the_earlier_files(tmp_path: Path) -> None:
    OutputFile(tmp_path / "a").write("first")
    with pytest.raises(ZeroDivisionError), OutputFile(tmp_path / "a").opened() as file:
        file.write(b"half")
        raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError), output_folder(tmp_path, "verb") as folder:
        (folder / "a").write_text("half")
        raise ZeroDivisionError
    assert (tmp_path / "a").read_text() == "first"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_is_not_called_like_a_file(tmp_path: Path) -> None:
    wanted = r"-o: wanted a folder, found .*page\.html; leave \.html out"
    with pytest.raises(InputError, match=wanted), output_folder(tmp_path / "page.html", "verb"):
        pass
    assert not [*tmp_path.iterdir()]


def test_a_file_that_appears_during_the_work_is_not_overwritten(tmp_path: Path) -> None:
    file = OutputFile(tmp_path / "a")
    (tmp_path / "a").write_text("user")
    with pytest.raises(InputError, match="not written by boresight"):
        file.write("ours")
    assert (tmp_path / "a").read_text() == "user"


def test_a_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "real")
    OutputFile(tmp_path / "link").write("text")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "text"


def test_outputs_of_several_writers_in_one_folder_are_all_listed(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: OutputFile(tmp_path / f"{k}").write("first"), range(32)))
        list(pool.map(lambda k: OutputFile(tmp_path / f"{k}").write("second"), range(32)))


def build(cache: Cache, identity: str, size: int = 1000) -> Path:
    def make(folder: Path) -> None:
        (folder / "data").write_bytes(bytes(size))

    return cache.get("a name/of mine", identity, make)


def test_the_cache_makes_an_entry_once(tmp_path: Path) -> None:
    made = []

    def make(folder: Path) -> None:
        made.append(folder)
        (folder / "sub").mkdir()
        (folder / "sub" / "data").write_text("text")

    with ThreadPoolExecutor(8) as pool:
        (path,) = set(pool.map(lambda _: Cache(tmp_path).get("n", "i", make), range(16)))
    assert len(made) == 1 and (path / "sub" / "data").read_text() == "text"
    assert build(Cache(tmp_path), "j") != path


def test_the_cache_keeps_no_failed_entry(tmp_path: Path) -> None:
    def make(folder: Path) -> None:
        (folder / "half").write_text("half")
        raise ValueError("no")

    with pytest.raises(ValueError):
        Cache(tmp_path).get("n", "i", make)
    assert [p.name for p in tmp_path.iterdir()] == ["locks"]


@pytest.mark.parametrize("damage", ["changed", "missing", "no list", "wrong list"])
def test_the_cache_makes_damaged_entries_again(tmp_path: Path, damage: str) -> None:
    folder = build(Cache(tmp_path), "i")
    if damage == "changed":
        (folder / "data").write_bytes(b"1" + bytes(999))
    elif damage == "missing":
        (folder / "data").unlink()
    elif damage == "no list":
        (folder / "entry.json").unlink()
    else:
        (folder / "entry.json").write_text("{")
    assert (build(Cache(tmp_path), "i") / "data").read_bytes() == bytes(1000)


def test_the_cache_removes_least_recently_used_entries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = Cache(tmp_path)
    folders = [build(cache, name) for name in "abc"]
    build(cache, "a")
    assert cache.usage() == sum(p.stat().st_size for f in folders for p in f.iterdir())
    monkeypatch.setattr(module, "_LIMIT", 2500)
    cache.trim()
    assert all(f.exists() for f in folders)  # used within the hour
    monkeypatch.setattr(module, "_RECENT_S", 0)
    cache.trim()
    assert [f.exists() for f in folders] == [True, False, True]


def test_a_text_is_kept_until_the_sources_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package, linked = tmp_path / "package", tmp_path / "linked"
    package.mkdir()
    linked.mkdir()
    (package / "folder").symlink_to(linked)
    monkeypatch.setattr(module, "_PACKAGE", package)
    monkeypatch.setattr(module, "cache_folder", lambda _: tmp_path / "cache")
    monkeypatch.setattr(module, "package_digest", lambda: module._digest_of(package))
    assert kept("n", "i", lambda: "a\r\n\u00b5\n") == "a\r\n\u00b5\n"
    assert kept("n", "i", lambda: "b") == "a\r\n\u00b5\n" and kept("n", "j", lambda: "c") == "c"
    (package / ".#of_an_editor.py").symlink_to("nobody@host.1")
    before = module._digest_of(package)
    assert kept("n", "j", lambda: "d") == "c"
    (linked / "new.py").write_text("x = 1")
    assert kept("n", "j", lambda: "e") == "e"
    # A process that has imported what is there no more keeps nothing.
    monkeypatch.setattr(module, "package_digest", lambda: before)
    assert [kept("n", "k", lambda text=text: text) for text in "fg"] == ["f", "g"]


def test_bytes(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"\0x")
    assert read_bytes(tmp_path / "a", "a file") == b"\0x"
    for path, entry in ((tmp_path, "a folder"), (tmp_path / "b", "no such file or directory"),
                        ("/dev/zero", "a device")):  # fmt: skip
        with pytest.raises(InputError, match=f"^{path}: wanted a file, found {entry}; check the"):
            read_bytes(path, "a file")
    with pytest.raises(InputError, match="^'': wanted a file, found no such file"):
        read_bytes("", "a file")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"  \n", "the file is empty"),
        (b"\0\0\0", "zeros"),
        (b"\xff\xfe", "'utf-8' codec can't decode byte 0xff"),
        (b'{"a": 1\n b}', "Expecting ',' delimiter: line 2 column 2"),
        (b"[NaN]", "NaN, which JSON does not have"),
        (b"[-Infinity]", "-Infinity, which JSON does not have"),
        (b'{"a": 1, "a": 2}', "'a' twice"),
        (b"1" * 101, "a number of 101 digits"),
        (b"[" * 100_000, "lists or objects nested too deeply"),
    ],
)
def test_json(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b'\xef\xbb\xbf{"a": [1, 2.5, null, "b"]}')
    assert read_json(path, "a map") == {"a": [1, 2.5, None, "b"]}
    path.write_bytes(content)
    message = f"{path}: wanted a map, found no JSON ({reason}"
    with pytest.raises(InputError, match=rf"^{re.escape(message)}.*\); correct the file$"):
        read_json(path, "a map")
