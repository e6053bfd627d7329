"""The journal of a campaign: a line for each draw that is done, so that nothing is lost.

Its first line says which campaign it belongs to; a file that begins otherwise is not touched.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError

__all__ = ["Journal"]


class Journal:
    """Draws that are done, in a file and in memory.

    Parameters
    ----------
    path : path
    identity : mapping
        What the draws depend on.

    Attributes
    ----------
    done : dict of int to dict
        By seed.

    Raises
    ------
    InputError
        The file is that of another campaign, or no journal, or cannot be written.
    """

    def __init__(self, path: Path, identity: dict[str, Any]) -> None:
        self.path, self.done = path, dict[int, dict[str, Any]]()
        head = json.dumps({"boresight montecarlo": identity}, sort_keys=True)
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            # A process that was killed leaves half a line.
            whole = text[: text.rfind("\n") + 1]
            lines = whole.splitlines()
            if text and (not lines or lines[0] != head):
                raise InputError.at(
                    str(path),
                    wanted="the journal of this campaign",
                    found="that of another one, or another file",
                    fix="choose another folder with -o, or remove it",
                )
            for line in lines[1:]:
                draw = json.loads(line)
                self.done[draw["seed"]] = draw
            self._head = "" if whole else head + "\n"  # written with the first draw
            if whole != text:
                path.write_text(whole, encoding="utf-8")
        except (OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError.at(
                str(path),
                wanted="a journal that can be read and written",
                found=str(error).splitlines()[0],
                fix="choose another folder with -o, or remove it",
            ) from None

    def add(self, draws: Iterable[dict[str, Any]]) -> None:
        """Append draws; they are on disk when this returns."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(self._head)
            self._head = ""
            for draw in draws:
                file.write(json.dumps(draw, sort_keys=True) + "\n")
                self.done[draw["seed"]] = draw
