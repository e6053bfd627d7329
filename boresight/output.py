"""Writing results: all of them, or none."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from boresight.model.errors import InputError

__all__ = ["output_folder", "write_file"]


def _refuse(path: Path, error: OSError) -> InputError:
    return InputError.at(
        str(path),
        wanted="a place that can be written",
        found=error.strerror or type(error).__name__,
        fix="choose another with -o, or change its permissions",
    )


@contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """A temporary folder whose contents move to ``path`` when everything has been written.

    Raises
    ------
    InputError
        ``path`` cannot be created or written: raised before any work is done.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        if not os.access(path, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
        temporary = Path(tempfile.mkdtemp(prefix=".boresight-", dir=path))
    except OSError as error:
        raise _refuse(path, error) from error
    try:
        yield temporary
        for item in sorted(temporary.iterdir()):
            target = path / item.name
            if target.is_dir() and not target.is_symlink():
                shutil.rmtree(target)
            os.replace(item, target)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def write_file(path: Path, text: str) -> None:
    """Write one file whole: to a neighbour first, then into place.

    Raises
    ------
    InputError
        The place cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".boresight-", dir=path.parent)
        with os.fdopen(handle, "w") as file:
            file.write(text)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except OSError as error:
        raise _refuse(path, error) from error
