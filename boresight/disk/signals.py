"""Signals deferred until files have been moved."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["deferred_signals"]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def deferred_signals() -> Iterator[None]:
    """Defer Ctrl-C, SIGTERM and SIGHUP to the end of the block.

    They interrupt the main thread only; in another thread this does nothing. Masking them would
    not help: another thread, for example of a linear algebra library, would receive them.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    usual: dict[signal.Signals, Any] = {}
    try:
        for number in _SIGNALS:
            if signal.getsignal(number) not in (None, signal.SIG_IGN):
                usual[number] = signal.signal(number, lambda n, frame: received.append(n))
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
        for late in dict.fromkeys(received):
            os.kill(os.getpid(), late)
