"""Settings that hold for everything that a verb reads."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any


@dataclass(frozen=True)
class Settings:
    """Settings of estimators that are looked up by name, and of log files."""

    #: Files of profiles; empty: no profile; None: the file beside each estimator's.
    profiles: tuple[str, ...] | None = None
    #: Accepted errors of outputs in place of the declared ones, ``NAME=NUMBER`` or
    #: ``NAME=NUMBERunit``. They decide what is judged and refused, not a bit of the program.
    tolerances: tuple[str, ...] = ()
    #: Rows of log files that are read, a `sim.records.selection.Selection`; None: all.
    rows: Any = None

    @property
    def options(self) -> str:
        """Options of a command line for profiles and tolerances, each after a space."""
        texts = [("tolerance", text) for text in self.tolerances]
        texts += [("profile", file) for file in self.profiles or ()]
        texts += [("profile", "none")] * (self.profiles == ())
        return "".join(f" --{name} {shlex.quote(text)}" for name, text in texts)


_DECLARED = Settings()
#: The settings in force.
CURRENT: ContextVar[Settings] = ContextVar("settings", default=_DECLARED)


@contextmanager
def using(**changes: Any) -> Iterator[None]:
    token = CURRENT.set(replace(CURRENT.get(), **changes))
    try:
        yield
    finally:
        CURRENT.reset(token)
