"""Results go out whole or not at all, through what is no plain file, and over nothing of others."""

from __future__ import annotations

import errno
import os
import signal
import threading
from pathlib import Path

import pytest

from boresight.disk.manifest import NAME, Manifest
from boresight.disk.output import OutputFile, free_name, output_folder, require_distinct
from boresight.model.errors import InputError


def fill(folder: Path, *names: str, by: str = "verb", text: str = "text") -> None:
    with output_folder(folder, by, files=names) as staged:
        for name in names:
            (staged / name).parent.mkdir(parents=True, exist_ok=True)
            (staged / name).write_text(text)


def names(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*"))


def test_clears_its_own_old_files_only(tmp_path: Path) -> None:
    fill(tmp_path, "a", "one/b", "two/c")
    fill(tmp_path, "d", by="other")
    (tmp_path / "two" / "user").write_text("user")
    fill(tmp_path, "a")
    assert names(tmp_path) == [NAME, "a", "d", "two", "two/user"]
    fill(tmp_path, "d", text="taken over")
    assert names(tmp_path) == [NAME, "d", "two", "two/user"]


def test_files_known_to_another_manifest_above_or_below(tmp_path: Path) -> None:
    fill(tmp_path / "sub", "a")
    fill(tmp_path, "sub/a", text="from above")
    fill(tmp_path / "sub", "a", text="from below")
    assert (tmp_path / "sub" / "a").read_text() == "from below"


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    with (
        pytest.raises(ZeroDivisionError),
        output_folder(tmp_path / "new" / "deep", "verb") as staged,
    ):
        (staged / "a").write_text("half")
        raise ZeroDivisionError
    assert names(tmp_path) == []
    with pytest.raises(FileNotFoundError), output_folder(tmp_path / "new", "verb"):
        (tmp_path / "none").read_text()  # not of the output: not its refusal
    assert names(tmp_path) == []


def test_a_disk_that_fills_up(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no space left"), output_folder(tmp_path, "verb"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert names(tmp_path) == []


def test_what_came_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not written by"), output_folder(tmp_path, "v") as staged:
        (staged / "a").write_text("ours")
        (tmp_path / "a").write_text("user")
    file = OutputFile(tmp_path / "b", "v")
    (tmp_path / "b").write_text("user")
    with pytest.raises(InputError, match="not written by"):
        file.write("ours")
    assert names(tmp_path) == ["a", "b"]
    assert (tmp_path / "a").read_text() == (tmp_path / "b").read_text() == "user"


def test_ctrl_c_during_the_moves_comes_after_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ctrl_c: None
) -> None:
    replace = Path.replace

    def interrupted(self: Path, target: Path) -> Path:
        os.kill(os.getpid(), signal.SIGINT)
        return replace(self, target)

    with (
        pytest.raises(KeyboardInterrupt),
        monkeypatch.context() as patch,
        output_folder(tmp_path, "verb") as staged,
    ):
        for name in "ab":
            (staged / name).write_text(name)
        patch.setattr(Path, "replace", interrupted)
    assert names(tmp_path) == [NAME, "a", "b"]


def test_permissions(tmp_path: Path) -> None:
    usual = os.umask(0o027)
    try:
        fill(tmp_path, "a", "sub/b")
        OutputFile(tmp_path / "c", "v").write("c")
    finally:
        os.umask(usual)
    assert [(tmp_path / n).stat().st_mode & 0o777 for n in ("a", "sub/b", "c")] == [0o640] * 3
    assert (tmp_path / "sub").stat().st_mode & 0o777 == 0o750
    (tmp_path / "a").chmod(0o664)
    fill(tmp_path, "a", text="new")
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o664


def test_a_second_run_overwrites_the_first(tmp_path: Path) -> None:
    for text in ("one", "two"):
        file = OutputFile(tmp_path / "new" / "a.csv", "run")
        assert not file.written
        file.write(text)
        assert file.written and (tmp_path / "new" / "a.csv").read_text() == text
    OutputFile(tmp_path / "new" / "b.csv", "run").write(b"b")
    assert names(tmp_path / "new") == [NAME, "a.csv", "b.csv"]


def test_looking_leaves_no_trace(tmp_path: Path) -> None:
    OutputFile(tmp_path / "new" / "deep" / "a.csv", "run")
    assert names(tmp_path) == []


def test_links_are_written_through(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    for link, target in (("file", "data/real"), ("again", "file")):
        (tmp_path / link).symlink_to(target)
    (tmp_path / "folder").symlink_to("data")
    OutputFile(tmp_path / "file", "run").write("one")
    OutputFile(tmp_path / "again", "run").write("two")
    assert (tmp_path / "data" / "real").read_text() == "two"
    fill(tmp_path / "folder", "x")
    assert (tmp_path / "data" / "x").read_text() == "text"
    assert all((tmp_path / n).is_symlink() for n in ("file", "again", "folder"))


def test_links_inside_a_folder_are_written_through(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    fill(out, "a")
    elsewhere.mkdir()
    (out / "a").rename(elsewhere / "a")
    (out / "a").symlink_to(elsewhere / "a")
    (out / "b").symlink_to(elsewhere / "b")
    fill(out, "a", "b", text="new")
    assert (out / "a").is_symlink() and (elsewhere / "a").read_text() == "new"
    assert (out / "b").is_symlink() and (elsewhere / "b").read_text() == "new"
    fill(out, "c")  # clears a and b: links are not ours to remove
    assert (out / "a").is_symlink() and (elsewhere / "a").read_text() == "new"


def test_other_names_of_a_file_keep_their_contents(tmp_path: Path) -> None:
    OutputFile(tmp_path / "a", "run").write("one")
    os.link(tmp_path / "a", tmp_path / "kept")
    OutputFile(tmp_path / "a", "run").write("two")
    assert (tmp_path / "kept").read_text() == "one" and (tmp_path / "a").read_text() == "two"


def read_fifo(path: Path, write) -> bytes:
    got = []
    reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
    reader.start()
    write()
    reader.join(10)
    return got[0]


def test_fifos_are_written_through(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert read_fifo(pipe, lambda: OutputFile(pipe, "run").write("text")) == b"text"
    assert read_fifo(pipe, lambda: fill(tmp_path, "pipe", "b", text="through")) == b"through"
    assert pipe.is_fifo() and names(tmp_path) == [NAME, "b", "pipe"]
    assert set(Manifest.load(tmp_path).files) == {"b"}


def test_a_reader_that_has_gone_is_no_refusal() -> None:
    reader, writer = os.pipe()
    file = OutputFile(f"/dev/fd/{writer}", "run")
    os.close(reader)
    with pytest.raises(BrokenPipeError):
        file.write("text")
    os.close(writer)


def test_devices_and_open_files(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = os.stat(os.devnull)
    OutputFile(os.devnull, "run").write("text")
    assert os.stat(os.devnull).st_rdev == before.st_rdev
    OutputFile("/dev/stdout", "run").write("out\n")
    OutputFile("/dev/fd/2", "run").write("err\n")
    assert capfd.readouterr() == ("out\n", "err\n")
    with (tmp_path / "read").open("w") as file:
        OutputFile(f"/proc/self/fd/{file.fileno()}", "run").write("kept ")
        file.write("both")
    assert (tmp_path / "read").read_text() == "kept both"


def test_two_outputs_that_are_one(tmp_path: Path) -> None:
    (tmp_path / "a").touch()
    os.link(tmp_path / "a", tmp_path / "b")
    for csv, plot in (("a", "a"), ("a", "b"), ("new", "./new")):
        with pytest.raises(InputError, match="same file as --csv; choose another with --plot"):
            require_distinct(csv=tmp_path / csv, plot=f"{tmp_path}/{plot}")
    require_distinct(csv=os.devnull, plot=os.devnull)
    require_distinct(csv=tmp_path / "a", plot=None)


def test_default_names_step_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert free_name("r.json", "check", option="-r") == Path("r.json")
    Path("r.json").write_text("user")
    Path("r-2.json").write_text("user")
    assert free_name("r.json", "check", option="-r") == Path("r-3.json")
    OutputFile("r-3.json", "check").write("ours")
    assert free_name("r.json", "check", option="-r") == Path("r-3.json")
    assert free_name("/proc/none/r.json", "check", option="-r") is None


def test_two_threads_into_one_folder(tmp_path: Path) -> None:
    def work(number: int) -> None:
        for _ in range(10):
            OutputFile(tmp_path / f"{number}.csv", "run").write(str(number))

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert names(tmp_path) == [NAME, *(f"{k}.csv" for k in range(4))]
    for k in range(4):
        OutputFile(tmp_path / f"{k}.csv", "run")  # all are known
