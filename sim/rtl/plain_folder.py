"""A temporary folder with a path that is legal for every tool, and links to other folders.

Make accepts no blank in a path, Verilator's launcher no special character of the shell, and both
write paths into rules and commands. Through the links they never see the paths of users' files.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from boresight.model.errors import ToolMissing

__all__ = ["plain_folder"]

_PLAIN = re.compile(r"[A-Za-z0-9_./+-]+")


@contextmanager
def plain_folder(links: Mapping[str, Path]) -> Iterator[Path]:
    """Make a private folder for the block; it is removed at the end.

    Parameters
    ----------
    links : mapping
        Targets of links, by their name in the folder.

    Raises
    ------
    ToolMissing
        No temporary folder has a plain path.
    """
    with tempfile.TemporaryDirectory(prefix="boresight-", dir=_temporary_folder()) as name:
        for link, target in links.items():
            (Path(name) / link).symlink_to(target)
        yield Path(name)


def _temporary_folder() -> str:
    candidates = [tempfile.gettempdir(), "/tmp", "/var/tmp", "/dev/shm"]
    for folder in map(os.path.realpath, candidates):
        if _PLAIN.fullmatch(folder) and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise ToolMissing(
        "simulators need a temporary folder whose path has only letters, digits and _ . + - /: "
        f"none of {', '.join(candidates)} is one that can be written; set TMPDIR to one"
    )
