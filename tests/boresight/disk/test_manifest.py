"""The list of our files: what it holds, whose a file is, and what is no such list."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import pytest

from boresight.disk.manifest import NAME, Entry, Manifest, State, digest, inside, path_in, state
from boresight.model.errors import InputError


def listed(folder: Path, name: str, *texts: str) -> None:
    probe = folder / "probe"
    hashes = []
    for text in texts:
        probe.write_text(text)
        hashes.append(digest(probe))
        probe.unlink()
    manifest = Manifest.load(folder)
    manifest.files[name] = Entry("verb", "of", tuple(hashes))
    (folder / NAME).write_text(manifest.to_json())


def test_round_trip(tmp_path: Path) -> None:
    listed(tmp_path, "b/c", "x", "y")
    listed(tmp_path, "a", "z")
    manifest = Manifest.load(tmp_path)
    assert set(manifest.by("verb")) == {"a", "b/c"} and not manifest.by("other")
    assert Manifest._parse(json.loads(manifest.to_json())) == manifest
    assert digest(tmp_path / NAME) == hashlib.sha256((tmp_path / NAME).read_bytes()).hexdigest()


def test_states(tmp_path: Path) -> None:
    path = tmp_path / "sub" / "a"
    path.parent.mkdir()
    assert state(path) is State.ABSENT
    path.write_text("mine")
    assert state(path) is State.FOREIGN
    listed(tmp_path, "sub/a", "mine", "old")
    assert state(path) is State.OURS
    path.write_text("old")
    assert state(path) is State.OURS
    path.write_text("edited")
    assert state(path) is State.CHANGED
    listed(path.parent, "a", "edited")  # a nearer list knows better
    assert state(path) is State.OURS
    path.unlink()
    os.mkfifo(path)
    assert state(path) is State.FOREIGN  # and the manifest does not wait for a writer


@pytest.mark.parametrize(
    "text",
    [
        "",
        "user's",
        "[]",
        "{}",
        "[" * 100_000,
        '{"boresight_manifest": 2, "files": {}, "folders": []}',
        '{"boresight_manifest": 1, "files": {"../a": {"by": "", "of": "", "sha256": []}},'
        ' "folders": []}',
        '{"boresight_manifest": 1, "files": {}, "folders": ["/etc"]}',
        '{"boresight_manifest": 1, "files": [], "folders": []}',
    ],
)
def test_something_else_under_the_name(tmp_path: Path, text: str) -> None:
    (tmp_path / NAME).write_text(text)
    with pytest.raises(InputError, match=r"^.*\.boresight\.json: wanted the list of files .*$"):
        Manifest.load(tmp_path)
    (tmp_path / "a").write_text("mine")
    assert state(tmp_path / "a") is State.FOREIGN


def test_a_link_under_the_name(tmp_path: Path) -> None:
    (tmp_path / "other").write_text(Manifest().to_json())
    (tmp_path / NAME).symlink_to("other")
    with pytest.raises(InputError):
        Manifest.load(tmp_path)


def test_each_user_has_his_own_where_all_may_write(tmp_path: Path) -> None:
    assert path_in(tmp_path) == tmp_path / ".boresight.json"
    tmp_path.chmod(0o1777)
    assert path_in(tmp_path) == tmp_path / f".boresight-{os.geteuid()}.json"


@pytest.mark.parametrize("name", ["", "/a", "..", "a/../b", "../a"])
def test_names_that_leave_the_folder(name: str) -> None:
    with pytest.raises(ValueError):
        inside(name)


def test_names_inside() -> None:
    assert inside("a/./b") == "a/b"
