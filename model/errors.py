"""Errors that a user of Boresight can cause and correct."""

from __future__ import annotations

import difflib
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import SupportsIndex, cast

#: Maximum length of a message's parts, in characters.
_WHERE, _WANTED, _FOUND = 120, 130, 130
#: Longest list of names that a message shows whole, in characters.
_LIST = 100


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
        """Build ``<where>: wanted <wanted>, found <found>; <fix>``.

        Parameters
        ----------
        where : str
            Location: a file with line and column, or the name of an argument; may be empty.
        wanted, found : str
            What is accepted, and the value instead.
        fix : str
            Remedy, in the imperative.

        Parts that are too long are shortened in their middle.
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
