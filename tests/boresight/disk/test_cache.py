"""The build cache: complete or absent, made once, limited, and never taken from who uses it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from boresight.disk import cache as module
from boresight.disk.cache import LIMIT_MB, LIMIT_VARIABLE, Cache, Cleared, Entry
from boresight.model.errors import InputError
from boresight.model.tools.folders import cache_folder

#: Uses or makes entry ``name``, says so, then waits until its input ends, or is killed in the make.
OTHER = """
import os, signal, sys
from pathlib import Path
from boresight.disk.cache import Cache
def make(folder):
    (folder / "data").write_bytes(bytes(1000))
    if sys.argv[3] == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
entry = Cache(Path(sys.argv[1])).get(sys.argv[2], sys.argv[2], make)
print(entry.path, flush=True)
sys.stdin.read()
"""


def get(cache: Cache, name: str, size: int = 1000) -> Entry:
    return cache.get(name, name, lambda folder: void((folder / "data").write_bytes(bytes(size))))


def void(_: object) -> None:
    pass


def used_long_ago(entry: Entry, seconds: int) -> None:
    path = entry.path / "entry.json"
    when = path.stat().st_mtime_ns - seconds * 10**9
    os.utime(path, ns=(when, when))


def entries(cache: Cache) -> list[str]:
    return sorted(p.name.split("-")[0] for p in cache.root.glob("*-*"))


def test_made_once(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "new")
    made = []

    def make(folder: Path) -> None:
        made.append(folder)
        (folder / "sub").mkdir()
        (folder / "sub" / "data").write_text("text")

    first, again = (cache.get("a name/of mine", "identity", make) for _ in range(2))
    assert len(made) == 1 and first.path == again.path
    assert first.path.name.startswith("a_name_of_mine-")
    assert (first.path / "sub" / "data").read_text() == "text"
    assert cache.get("a name/of mine", "another", make).path != first.path
    assert len(made) == 2
    usage = cache.usage()
    assert (usage.path, usage.entries, usage.size) == (cache.root, 2, 8)


def test_many_threads_make_it_once(tmp_path: Path) -> None:
    made = []

    def make(folder: Path) -> None:
        made.append(folder)
        (folder / "data").write_text("text")

    with ThreadPoolExecutor(8) as pool:
        results = set(pool.map(lambda _: Cache(tmp_path).get("n", "i", make).path, range(16)))
    assert len(results) == len(made) == 1


def test_a_make_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def make(folder: Path) -> None:
        (folder / "half").write_text("half")
        raise ValueError("no")

    with pytest.raises(ValueError):
        Cache(tmp_path).get("n", "i", make)
    assert [p.name for p in tmp_path.iterdir()] == ["locks"]


def test_a_killed_process_leaves_no_entry_and_its_work_goes(tmp_path: Path) -> None:
    run = subprocess.run([sys.executable, "-c", OTHER, str(tmp_path), "n", "dies"])
    assert run.returncode == -9
    assert [p.name[:5] for p in tmp_path.iterdir() if p.name != "locks"] == ["work-"]
    cache = Cache(tmp_path)
    assert cache.usage().entries == 0
    assert (get(cache, "n").path / "data").stat().st_size == 1000
    assert entries(cache) == ["n"]


@pytest.mark.parametrize("how", ["shorter", "other", "gone", "no list", "bad list", "old format"])
def test_damaged_entries_are_made_anew(
    tmp_path: Path, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = Cache(tmp_path)
    folder = get(cache, "n").path
    monkeypatch.setattr(module, "_known_sound", set())  # as another process would see it
    data, listed = folder / "data", folder / "entry.json"
    if how == "shorter":
        data.write_bytes(bytes(999))
    elif how == "other":
        data.write_bytes(b"1" + bytes(999))
    elif how == "gone":
        data.unlink()
    elif how == "no list":
        listed.unlink()
    elif how == "bad list":
        listed.write_text("{")
    else:
        listed.write_text(json.dumps({**json.loads(listed.read_text()), "format": 0}))
    assert (get(cache, "n").path / "data").read_bytes() == bytes(1000)
    assert entries(cache) == ["n"]


def test_least_recently_used_go_first(tmp_path: Path) -> None:
    cache = Cache(tmp_path, limit_mb=0.0035)
    for age, name in enumerate(("c", "b", "a")):
        used_long_ago(get(cache, name), 100 - 10 * age)
    get(cache, "c")  # used anew: b is now the oldest
    get(cache, "d")
    assert entries(cache) == ["a", "c", "d"]
    get(Cache(tmp_path, limit_mb=0.001), "e")
    assert entries(cache) == ["e"]


def test_entries_are_counted_only_when_there_may_be_too_many(tmp_path: Path) -> None:
    cache, size = Cache(tmp_path, limit_mb=0.01), tmp_path / "size"
    for age, name in enumerate("abcdefghij"):
        used_long_ago(get(cache, name), 100 - age)
        assert int(size.read_text()) == 1000 * (age + 1)
    (next(tmp_path.glob("b-*")) / "entry.json").unlink()
    get(cache, "k")  # Eleven, but for the damaged one.
    assert cache.usage().entries == 10 and int(size.read_text()) == 10_000
    get(cache, "l")
    assert cache.usage().entries == 9 and int(size.read_text()) == 9000
    size.write_text("nan")
    get(cache, "m")
    assert cache.usage().entries == 10 and int(size.read_text()) == 10_000


def test_what_is_in_use_stays(tmp_path: Path) -> None:
    cache = Cache(tmp_path, limit_mb=0)
    mine = get(cache, "mine")
    with subprocess.Popen(
        [sys.executable, "-c", OTHER, str(tmp_path), "other", "waits"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        get(cache, "free")
        assert entries(cache) == ["free", "mine", "other"]
        cache.trim()
        assert entries(cache) == ["mine", "other"]
        assert cache.clear().in_use == 2
        assert (mine.path / "data").exists()
        process.kill()
    del mine
    assert cache.clear() == Cleared(2, 2000, 0)
    assert not tmp_path.exists()


def test_clear_removes_only_what_was_put_there(tmp_path: Path) -> None:
    cache = Cache(tmp_path)
    get(cache, "a")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "x.log").write_text("")
    theirs = ["notes", "mine-0123", "work-of-mine", f"mine-{'0' * 32}"]
    for name in theirs:
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text("user")
    (tmp_path / "locks" / "mine").write_text("user")
    (tmp_path / f"link-{'0' * 32}").symlink_to(tmp_path / "notes")
    cleared = cache.clear()
    assert (cleared.entries, cleared.size) == (1, 1000)
    left = sorted(p.name for p in tmp_path.iterdir())
    assert left == sorted([*theirs, "locks", f"link-{'0' * 32}"])
    assert [p.name for p in (tmp_path / "locks").iterdir()] == ["mine"]
    assert all((tmp_path / name / "file").read_text() == "user" for name in theirs)


def test_clearing_an_empty_place(tmp_path: Path) -> None:
    cache = Cache(tmp_path / "none")
    assert cache.clear() == Cleared(0, 0, 0) and cache.usage().entries == 0
    assert not (tmp_path / "none").exists()


def test_place_and_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(LIMIT_VARIABLE, raising=False)
    assert (Cache().root, Cache().limit) == (cache_folder("boresight"), LIMIT_MB * 10**6)
    assert Cache().root == tmp_path / "boresight"
    monkeypatch.setenv(LIMIT_VARIABLE, "2.5")
    assert Cache().limit == 2_500_000
    for bad in ("much", "-1", "nan", "inf"):
        monkeypatch.setenv(LIMIT_VARIABLE, bad)
        with pytest.raises(InputError, match=r"^BORESIGHT_CACHE_MB: wanted megabytes"):
            Cache()
