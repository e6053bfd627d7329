"""One file for each verb of the command line, its function and its text; `texts` is its help."""

from __future__ import annotations

__all__ = ["place_of"]

#: Verbs of the room `boresight.verbs.figures`.
_FIGURES = ("accuracy", "bench", "covariance", "montecarlo", "tune")


def place_of(verb: str) -> str:
    """Name of a verb's module, below ``boresight``."""
    return f"verbs.figures.{verb}" if verb in _FIGURES else f"verbs.{verb}"
