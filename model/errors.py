"""The errors that a user of Boresight can cause and can mend."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable

__all__ = ["InputError", "ToolMissing", "closest", "require", "shortened"]

#: Most characters of a message's parts.
_WHERE, _WANTED, _FOUND = 120, 130, 60


def shortened(text: str, most: int) -> str:
    """The text, without its middle if it has more than ``most`` characters."""
    if len(text) <= most:
        return text
    end = 2 * (most - 3) // 3  # the end of a path, and the line behind it, say most
    return f"{text[: most - 3 - end]}...{text[len(text) - end :]}"


def closest(name: str, known: Iterable[str], most: int = 4) -> list[str]:
    """The ``most`` names that are most like ``name``, to be shown where it is unknown."""
    return difflib.get_close_matches(name[:100], list(known), most, 0.0)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class InputError(ValueError):
    """Something that came from outside is not what it has to be.

    The message is always a single line; the command line prints it after ``error:`` and exits
    with code 2. A complete message says where the trouble is, what was wanted, what was found and
    what to do about it: `InputError.at` builds one of that form.

    Parameters
    ----------
    message : str
        Text of the error. Line breaks and runs of blanks become single spaces; other characters
        that cannot be printed are written as escapes.
    """

    def __init__(self, message: str) -> None:
        super().__init__(_printable(" ".join(message.split())))

    @classmethod
    def at(cls, where: str, *, wanted: str, found: str, fix: str) -> InputError:
        """Build ``<where>: wanted <wanted>, found <found>; <fix>``.

        Parameters
        ----------
        where : str
            Place of the trouble: a file with line and column, or the name of an argument.
        wanted, found : str
            What is legal there, and what stands there instead.
        fix : str
            What the user can do about it.

        What is too long to read loses its middle: ``where`` and ``found`` come from outside. Where
        nobody knows the place, the line begins with what was wanted.
        """
        place = f"{shortened(where, _WHERE)}: " if where else ""
        wanted, found = shortened(wanted, _WANTED), shortened(found, _FOUND)
        return cls(f"{place}wanted {wanted}, found {found}; {fix}")


def require(
    good: bool, where: str | Callable[[], str], wanted: str, found: object, fix: str = "correct it"
) -> None:
    """`InputError.at`, with ``found`` as Python writes it, unless it is good.

    ``where`` may be a function, called only then.
    """
    if not good:
        place = where if isinstance(where, str) else where()
        raise InputError.at(place, wanted=wanted, found=repr(found), fix=fix)


class ToolMissing(RuntimeError):
    """An external program is needed and not installed; the message says which and how to get it."""
