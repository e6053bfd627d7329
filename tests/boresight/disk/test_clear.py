"""`make clean`: results go, the user's own files stay."""

from __future__ import annotations

from pathlib import Path

from boresight.disk.clear import clear, main
from boresight.disk.manifest import NAME
from boresight.disk.output import OutputFile, output_folder


def results(place: Path) -> None:
    for folder in (place, place / "board"):
        with output_folder(folder, "verb") as staged:
            (staged / "sub" / "deep").mkdir(parents=True)
            (staged / "a").write_text("a")
            (staged / "sub" / "deep" / "b").write_text("b")


def test_everything_goes_that_we_made(tmp_path: Path) -> None:
    results(tmp_path / "build")
    assert clear(tmp_path / "build") == []
    assert list(tmp_path.iterdir()) == []


def test_the_users_files_stay(tmp_path: Path, capsys) -> None:
    build = tmp_path / "build"
    results(build)
    (build / "sub" / "user").write_text("user")
    (build / "board" / "a").write_text("edited")
    (build / "board" / "empty").mkdir()
    OutputFile(tmp_path / "other", "verb").write("other")
    assert main([str(build)]) == 0
    left = {p.relative_to(build).as_posix() for p in build.rglob("*")}
    assert left == {"board", "board/a", f"board/{NAME}", "board/empty", "sub", "sub/user"}
    assert (tmp_path / "other").exists()
    assert "6 files and folders stay" in capsys.readouterr().out


def test_nothing_there(tmp_path: Path, capsys) -> None:
    (tmp_path / "file").write_text("user")
    assert main([str(tmp_path / "none"), str(tmp_path / "file"), ""]) == 0
    assert (tmp_path / "file").exists()
    (tmp_path / NAME).write_text("user")
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("error: ")
