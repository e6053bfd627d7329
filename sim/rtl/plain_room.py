"""A temporary folder whose path every tool can take, with links to what lies elsewhere.

Make takes no blank in a path, Verilator's launcher no character that a shell reads, and both write
what they are given into rules and commands. So they never see where the user's files are.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from boresight.model.errors import ToolMissing

__all__ = ["plain_room"]

_PLAIN = re.compile(r"[A-Za-z0-9_./+-]+")


@contextmanager
def plain_room(links: Mapping[str, Path]) -> Iterator[Path]:
    """A new folder of ours alone, removed at the end.

    Parameters
    ----------
    links : mapping
        Name in the folder -> what a link of that name leads to.

    Raises
    ------
    ToolMissing
        No temporary folder has a plain path.
    """
    with tempfile.TemporaryDirectory(prefix="boresight-", dir=_plain_folder()) as name:
        for link, target in links.items():
            (Path(name) / link).symlink_to(target)
        yield Path(name)


def _plain_folder() -> str:
    candidates = [tempfile.gettempdir(), "/tmp", "/var/tmp", "/dev/shm"]
    for folder in map(os.path.realpath, candidates):
        if _PLAIN.fullmatch(folder) and os.access(folder, os.W_OK | os.X_OK):
            return folder
    raise ToolMissing(
        "simulators need a temporary folder whose path has only letters, digits and _ . + - /: "
        f"none of {', '.join(candidates)} is one that can be written; set TMPDIR to one"
    )
