"""The logs in the package, by name."""

from __future__ import annotations

from pathlib import Path

from boresight.model.errors import InputError

#: Bundled logs whose attitude is another device's estimate, not truth.
_COMPARISONS = ("ximu_walk",)


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
    """Whether a path is that of a bundled log whose attitude is a comparison, not truth."""
    path = Path(path)
    return path.stem in _COMPARISONS and path.resolve().parent == _FOLDER.resolve()
