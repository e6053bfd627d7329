"""The logs in the package, by name."""

from __future__ import annotations

from pathlib import Path

from boresight.model.errors import InputError

#: In a comment above the columns of a CSV log: its attitude is another device's estimate.
_COMPARISON = "a comparison, not truth"
#: Longest such comment, characters.
_LONGEST = 1000
_FOLDER = Path(__file__).parents[1] / "data"


def bundled_names() -> tuple[str, ...]:
    """List the bundled logs: file names without suffix, sorted."""
    return tuple(sorted(path.stem for path in _FOLDER.glob("*.csv")))


def bundled(name: str) -> Path:
    """Path of one of `bundled_names`, a CSV log; raises `InputError` for other names."""
    if name not in bundled_names():
        names = ", ".join(bundled_names())
        raise InputError(f"name must be one of the bundled logs ({names}), not {name!r}")
    return _FOLDER / f"{name}.csv"


def is_comparison(path: str | Path) -> bool:
    """Whether a comment above a log's columns says that its attitude is no truth."""
    if not Path(path).is_file():
        return False
    with open(path, encoding="utf-8", errors="replace") as file:
        while (line := file.readline(_LONGEST)).startswith("#"):
            if _COMPARISON in line:
                return True
    return False
