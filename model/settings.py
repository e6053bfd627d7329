"""Settings that hold for everything that a verb reads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True)
class Settings:
    """Settings of estimators that are looked up by name, and of log files.

    Attributes
    ----------
    profiles : tuple of str, optional
        Files of profiles; empty: no profile; None: the file beside each estimator's.
    tolerances : tuple of str
        Accepted errors in place of the declared ones (`model.tolerances`).
    rows : sim.records.selection.Selection, optional
        Rows of log files that are read; None: all.
    """

    profiles: tuple[str, ...] | None = None
    tolerances: tuple[str, ...] = ()
    rows: Any = None


_DECLARED = Settings()
#: The settings in force.
CURRENT: ContextVar[Settings] = ContextVar("settings", default=_DECLARED)


@contextmanager
def using(**changes: Any) -> Iterator[None]:
    """Change some settings inside a block."""
    token = CURRENT.set(replace(CURRENT.get(), **changes))
    try:
        yield
    finally:
        CURRENT.reset(token)
