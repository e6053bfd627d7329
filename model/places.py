"""The line of an estimator's author that is being executed, not that of the toolkit under it."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

#: Folders without estimators.
_ROOMS = [Path(__file__).parent / room for room in ("", "lowering", "algebra", "kalman")]
#: The whole package, whose files no user wrote.
_PACKAGE = str(Path(__file__).parents[1]) + os.sep
#: Code that was written by dataclasses, frozen, or by numpy; others in <> are of a console.
_WRITTEN = ("<string>", "<frozen ", "<__array_function__")
#: Likewise everything below these folders.
_LIBRARIES = tuple(str(Path(file).parent) + os.sep for file in (np.__file__, os.__file__))


def _place(path: str, line: int | None) -> str:
    return f"{os.path.basename(path)}, line {line}"


@lru_cache(maxsize=256)
def _is_authors(file: str) -> bool:
    if file.startswith(_WRITTEN):
        return False
    installed = "site-packages" in file or "dist-packages" in file
    if file.startswith(_LIBRARIES[:1] if installed else _LIBRARIES):
        return False
    return Path(file).parent not in _ROOMS


def author_line() -> str:
    """The running line, "file.py, line 41": the innermost line of an author, else ""."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and not _is_authors(frame.f_code.co_filename):
        frame = frame.f_back
    return "" if frame is None else _place(frame.f_code.co_filename, frame.f_lineno)


def place_of(error: BaseException, *, users: bool = False) -> str:
    """The innermost line of an author (of ``users``: outside this package), else ""."""
    for f in reversed(traceback.extract_tb(error.__traceback__)):
        if _is_authors(f.filename) and not (users and f.filename.startswith(_PACKAGE)):
            return _place(f.filename, f.lineno)
    return ""


def place_of_function(function: Callable[..., Any]) -> str:
    """The line at which a function begins, else ""."""
    code = getattr(function, "__code__", None)
    return "" if code is None else _place(code.co_filename, code.co_firstlineno)


def placed(line: str, where: str) -> str:
    """``where`` behind the line, if there is one."""
    return f"{line}, {where}" if line else where
