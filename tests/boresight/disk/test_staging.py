"""A process may be killed at any time: each file is old or new, and the next one mends the rest."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from boresight.disk.manifest import NAME, Manifest, State, state
from boresight.disk.output import OutputFile, output_folder
from boresight.disk.staging import Staging

#: Writes two files anew, one more, and no longer writes a fourth; dies at the n-th write.
SCRIPT = """
import os, signal, sys
from boresight.disk.output import output_folder
left = int(sys.argv[2])
WRITES = ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "shutil.rmtree")
def hook(event, args):
    global left
    writes = event in WRITES or event == "open" and args[2] & (os.O_WRONLY | os.O_RDWR)
    if writes and sys.argv[1] in str(args[0]):
        left -= 1
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)
sys.addaudithook(hook)
with output_folder(sys.argv[1], "verb", files=["a.txt", "sub/b.txt"]) as folder:
    (folder / "sub").mkdir()
    (folder / "new").mkdir()
    for name in ("a.txt", "sub/b.txt", "new/c.txt"):
        (folder / name).write_text("new " + name)
"""


def write(folder: Path, files: dict[str, str], verb: str = "verb") -> None:
    with output_folder(folder, verb) as staged:
        for name, text in files.items():
            (staged / name).parent.mkdir(parents=True, exist_ok=True)
            (staged / name).write_text(text)


def contents(folder: Path) -> dict[str, str]:
    return {
        p.relative_to(folder).as_posix(): p.read_text()
        for p in folder.rglob("*")
        if p.is_file() and p.name != NAME
    }


def start(folder: Path) -> None:
    folder.mkdir()
    (folder / "user.txt").write_text("user")
    (folder / "sub").mkdir()
    (folder / "sub" / "user.txt").write_text("user too")
    write(folder, {"a.txt": "old a.txt", "sub/b.txt": "old sub/b.txt", "gone/d.txt": "old d.txt"})


def test_killed_at_every_write(tmp_path: Path) -> None:
    users = {"user.txt": "user", "sub/user.txt": "user too"}
    done = {name: f"new {name}" for name in ("a.txt", "sub/b.txt", "new/c.txt")}
    forward = 0
    for step in range(200):
        folder = tmp_path / f"step{step}"
        start(folder)
        code = subprocess.run([sys.executable, "-c", SCRIPT, str(folder), str(step)]).returncode
        visible = {k: v for k, v in contents(folder).items() if not k.startswith(".boresight-")}
        assert visible.items() >= users.items()
        for name, text in visible.items():
            assert name in users or text in (f"old {Path(name).name}", f"old {name}", f"new {name}")
            assert name in users or state(folder / name) is State.OURS  # also before the mending
        # The next run of another verb mends, and everything left is known as ours.
        OutputFile(folder / "other.csv", "other")
        after = contents(folder)
        assert not [name for name in after if ".boresight-" in name]
        ours = {k: v for k, v in after.items() if k not in users}
        assert ours == done or all(v.startswith("old") for v in ours.values()), (step, ours)
        assert all(state(folder / name) is State.OURS for name in ours)
        assert (folder / "gone").exists() == ("gone/d.txt" in ours)
        if code == 0:
            break
        assert code == -9
        forward += ours == done
    assert step > 15 and forward >= 5
    assert ours == done


def test_a_living_process_keeps_its_staging(tmp_path: Path) -> None:
    held = Staging(tmp_path)
    (held.new / "a").write_text("a")
    write(tmp_path, {"b": "b"})
    assert (held.new / "a").read_text() == "a"
    held.remove()
    assert sorted(p.name for p in tmp_path.iterdir()) == [NAME, "b"]


@pytest.mark.parametrize("what", ["file", "folder", "full", "link"])
def test_only_staging_folders_are_removed(tmp_path: Path, what: str) -> None:
    """Files of the user whose names look like ours."""
    place = tmp_path / ".boresight-abcdefgh"
    if what == "file":
        place.write_text("user")
    elif what == "link":
        (tmp_path / "target").mkdir()
        place.symlink_to(tmp_path / "target")
    else:
        place = tmp_path / ".boresight-notes" if what == "folder" else place
        place.mkdir()
        (place / "user.txt").write_text("user")
    write(tmp_path, {"b": "b"})
    assert place.exists() and (what != "full" or (place / "user.txt").read_text() == "user")


def test_a_journal_that_leads_out_is_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (tmp_path / "victim").write_text("user")
    left = folder / ".boresight-abcdefgh"
    (left / "new").mkdir(parents=True)
    journal = {"by": "verb", "of": "", "files": {"../victim": "0"}, "clears": False}
    (left / "journal.json").write_text(json.dumps(journal))
    write(folder, {"b": "b"})
    assert (tmp_path / "victim").read_text() == "user" and not left.exists()


def test_what_a_user_put_in_the_way_of_a_recovery_stays(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    left = folder / ".boresight-abcdefgh"
    (left / "new").mkdir(parents=True)
    (left / "new" / "a").write_text("staged")
    journal = {"by": "verb", "of": "", "files": {"a": "0" * 64}, "clears": True}
    (left / "journal.json").write_text(json.dumps(journal))
    (folder / "a").write_text("user")
    write(folder, {"b": "b"}, "other")
    assert (folder / "a").read_text() == "user"
    assert not left.exists()


def test_the_manifest_is_the_same_for_the_same_files(tmp_path: Path) -> None:
    for name in ("x", "y"):
        write(tmp_path / name, {"b": "1", "a/c": "2"})
    assert (tmp_path / "x" / NAME).read_bytes() == (tmp_path / "y" / NAME).read_bytes()
    assert Manifest.load(tmp_path / "x").folders == {"a"}
