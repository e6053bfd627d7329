"""The errors that a user of Boresight can cause and can mend."""

from __future__ import annotations

__all__ = ["InputError", "ToolMissing"]


class InputError(ValueError):
    """Something that came from outside is not what it has to be.

    The message is always a single line; the command line prints it after ``error: `` and exits
    with code 2. A complete message says where the trouble is, what was wanted, what was found and
    what to do about it: `InputError.at` builds one of that form.

    Parameters
    ----------
    message : str
        Text of the error. Line breaks and runs of blanks become single spaces.
    """

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))

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
        """
        return cls(f"{where}: wanted {wanted}, found {found}; {fix}")


class ToolMissing(RuntimeError):
    """An external program is needed and not installed; the message says which and how to get it."""
