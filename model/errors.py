"""Errors that a user of Boresight can cause and correct, and the line that caused them.

The line is that of an estimator's author that runs, not that of the toolkit under it.
"""

from __future__ import annotations

import difflib
import operator
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import Any, SupportsIndex, cast

#: Maximum length of a message's parts, in characters.
_WHERE, _WANTED, _FOUND = 120, 130, 130
#: Longest list of names that a message shows whole, in characters.
_LIST = 100
#: Folders without estimators.
_ROOMS = [Path(__file__).parent / room for room in ("", "algebra", "kalman", "lowering", "words")]
#: The whole package, whose files no user wrote.
_PACKAGE = str(Path(__file__).parents[1]) + os.sep
#: Code that was written by dataclasses, frozen, or by numpy; others in <> are of a console.
_WRITTEN = ("<string>", "<frozen ", "<__array_function__")
#: Likewise everything below these folders.
_LIBRARIES = tuple(
    str(Path(file).parent) + os.sep
    for file in (getattr(find_spec("numpy"), "origin", ""), os.__file__)
)


def shortened(text: str, limit: int) -> str:
    """Shorten a text to ``limit`` characters by leaving out its middle."""
    if len(text) <= limit:
        return text
    end = 2 * (limit - 3) // 3  # the end of a path and its line number matter most
    return f"{text[: limit - 3 - end]}...{text[len(text) - end :]}"


def closest(name: str, names: Iterable[str]) -> list[str]:
    """Return the four names closest to an unknown ``name``."""
    return difflib.get_close_matches(name[:100], list(names), 4, 0.0)


def listed(name: str, names: Iterable[str]) -> str:
    """Return all ``names`` in their order, or how many they are and those nearest to ``name``."""
    every = list(names)
    text = ", ".join(every)
    if len(text) <= _LIST:
        return text
    return f"{len(every)} names, nearest: {', '.join(closest(name, every))}"


class InputError(ValueError):
    """Invalid input from a user: argument, file, estimator or log.

    The message is a single line, with spaces for line breaks and escapes for other characters that
    cannot be printed; the command line prints it after ``error:`` and exits with code 2.
    `InputError.at` builds a message of location, what was wanted, what was found, and a remedy.
    """

    #: ``where``, ``wanted``, ``found``, ``fix``, of a message that has them.
    parts: Mapping[str, str] = {}

    def __init__(self, message: str) -> None:
        line = " ".join(message.split())
        super().__init__("".join(c if c.isprintable() else ascii(c)[1:-1] for c in line))

    @classmethod
    def at(cls, where: str, *, wanted: str, found: str, fix: str) -> InputError:
        """Build ``<where>: wanted <wanted>, found <found>; <fix>``; long parts lose their middle.

        ``where`` is a file with line and column, or the name of an argument; it may be empty.
        ``wanted`` is what is accepted, ``found`` the value instead, ``fix`` the remedy, in the
        imperative.
        """
        prefix = f"{shortened(where, _WHERE)}: " if where else ""
        wanted, found = shortened(wanted, _WANTED), shortened(found, _FOUND)
        error = cls(f"{prefix}wanted {wanted}, found {found}; {fix}")
        error.parts = {"where": where, "wanted": wanted, "found": found, "fix": fix}
        return error


def require(
    good: bool, where: str | Callable[[], str], wanted: str, found: object, fix: str = "correct it"
) -> None:
    """Raise `InputError.at` unless ``good``.

    The message has ``found`` itself if that is a text of several words, else its repr. ``where``
    may be a function, called only then.
    """
    if not good:
        location = where if isinstance(where, str) else where()
        text = found if isinstance(found, str) and " " in found else repr(found)
        text = "none" if text in {"None", "()", "[]", "{}"} else text
        raise InputError.at(location, wanted=wanted, found=text, fix=fix)


def require_choice(
    where: str, value: object, choices: Iterable[object], fix: str = "choose one of these"
) -> None:
    """Raise `InputError.at` unless ``value`` is one of ``choices``."""
    names = list(choices)
    if value not in names:
        wanted = f"one of {listed(str(value), map(str, names))}"
        raise InputError.at(where, wanted=wanted, found=repr(value), fix=fix)


def require_whole(where: str, value: object, low: int, high: int | None = None) -> None:
    """Raise `InputError.at` unless ``value`` is None or a whole number in a range."""
    try:
        number = low if value is None else operator.index(cast(SupportsIndex, value))
    except TypeError:
        number = low - 1
    if number < low or (high is not None and number > high):
        wanted = f"{low:,} or more" if high is None else f"{low:,} to {high:,}"
        raise InputError.at(where, wanted=wanted, found=str(value), fix="choose another")


class ToolMissing(RuntimeError):
    """An external program is not installed; the message says which and how to install it."""


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
