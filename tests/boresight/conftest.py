"""A folder of a user, with an estimator of their own, its world and its log."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import boresight
from boresight.cli import main
from tests.support.pages import user_folder


@pytest.fixture(scope="session")
def starter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``mine.py`` and ``mine.csv``."""
    folder = tmp_path_factory.mktemp("starter")
    with pytest.MonkeyPatch.context() as patch, user_folder(folder, patch):
        boresight.new("mine")
    return folder


@pytest.fixture
def here(starter: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The working folder, with a copy of ``starter``."""
    with user_folder(Path(shutil.copytree(starter, tmp_path, dirs_exist_ok=True)), monkeypatch):
        yield tmp_path


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """A function that runs a command line and returns what it prints on standard output."""

    def run(line: str, code: int = 0) -> str:
        capsys.readouterr()
        assert main(line.split()) == code, capsys.readouterr()
        return capsys.readouterr().out

    return run


@pytest.fixture
def data(said: Callable[..., str]) -> Callable[..., dict[str, Any]]:
    """A function that runs a command line with ``--json`` and returns the object."""

    def run(line: str, code: int = 0) -> dict[str, Any]:
        result: dict[str, Any] = json.loads(said(f"{line} --json -q", code))
        return result

    return run


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[[str], str]:
    """A function that runs a command line that is wrong: one line, exit code 2, and no output."""

    def run(line: str) -> str:
        capsys.readouterr()
        assert main(line.split()) == 2
        out, err = capsys.readouterr()
        assert not out and err.startswith("error: ") and err.count("\n") == 1, (out, err)
        return err.removeprefix("error: ").rstrip("\n")

    return run
