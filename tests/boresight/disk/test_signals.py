"""Signals wait for the end of a block, then come."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading

import pytest

from boresight.disk.signals import deferred_signals


def test_ctrl_c_comes_at_the_end(ctrl_c: None) -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_signals():
        os.kill(os.getpid(), signal.SIGINT)
        with deferred_signals():
            os.kill(os.getpid(), signal.SIGINT)
        done.append(1)
    assert done == [1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_after_an_error_inside(ctrl_c: None) -> None:
    with pytest.raises(KeyboardInterrupt), deferred_signals():
        os.kill(os.getpid(), signal.SIGINT)
        raise ValueError("first")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_the_usual_end_comes_late(number: signal.Signals) -> None:
    code = (
        "import os, signal; from boresight.disk.signals import deferred_signals\n"
        f"signal.signal({int(number)}, signal.SIG_DFL)\n"  # not as under nohup
        f"with deferred_signals():\n"
        f"    os.kill(os.getpid(), {int(number)}); print('done', flush=True)\n"
        "print('not reached')"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (-number, "done\n")


def test_ignored_signals_stay_ignored() -> None:
    usual = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with deferred_signals():
            os.kill(os.getpid(), signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, usual)


def test_in_another_thread_nothing_happens(ctrl_c: None) -> None:
    seen = []

    def work() -> None:
        with deferred_signals():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
