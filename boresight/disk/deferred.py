"""Signals that must wait until a few moves are done."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["deferred"]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def deferred() -> Iterator[None]:
    """Ctrl-C, SIGTERM and SIGHUP that come meanwhile come at the end of the block.

    Outside the main thread, which alone they interrupt, there is nothing to do. Masking them would
    not help: another thread, of a linear algebra library say, would take them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    usual: dict[int, Any] = {}
    try:
        for number in _SIGNALS:
            if signal.getsignal(number) not in (None, signal.SIG_IGN):
                usual[number] = signal.signal(number, lambda n, frame: came.append(n))
        yield
    finally:
        for known, handler in usual.items():
            signal.signal(known, handler)
        for late in dict.fromkeys(came):
            os.kill(os.getpid(), late)
