"""Tasks in processes: the same results as here; nothing waits for what will never come."""

import itertools
import math
import os
import signal
import sys
from operator import truediv

import pytest

from boresight.model.errors import InputError
from boresight.model.tools.failure import ToolFailed
from boresight.sim.processes import dispatch, processes

TASKS = [(k, math.factorial, (k,)) for k in (5, 3, 8)]
pytestmark = pytest.mark.pythons

#: More than a pipe takes at once, to a process that has still to start.
LARGE = bytes(10_000_000)


def ended_by(signal_number: int, data: bytes = b"") -> int:
    os.kill(os.getpid(), signal_number)
    return len(data)


def refuse() -> None:
    raise InputError.at("log", wanted="rows", found="none", fix="record some")


class Unpicklable(Exception):
    def __init__(self, first: int, other: int) -> None:
        super().__init__(f"{first} and {other}")


def fail_oddly() -> None:
    raise Unpicklable(1, 2)


def test_here_in_order() -> None:
    assert list(dispatch(1, TASKS)) == [(5, 120), (3, 6), (8, 40320)]


def test_in_processes() -> None:
    assert dict(dispatch(2, TASKS)) == dict(dispatch(1, TASKS))
    elsewhere = dict(dispatch(2, [("a", os.getpid, ()), ("b", os.getpid, ())]))
    assert os.getpid() not in elsewhere.values()
    assert list(dispatch(2, [])) == []
    assert list(dispatch(2, [("one", os.getpid, ())])) == [("one", os.getpid())]
    assert (processes(3), processes(None)) == (3, os.cpu_count())
    assert dict(dispatch(2, [(k, len, (LARGE,)) for k in range(3)])) == dict.fromkeys(
        range(3), 10**7
    )


def test_a_task_is_taken_when_a_process_is_free() -> None:
    taken = itertools.count()
    results = dispatch(2, ((k, abs, (k,)) for k in taken))  # without end
    assert [next(results) for _ in range(5)] and next(taken) <= 7
    results.close()


@pytest.mark.parametrize(
    ("work", "arguments", "error", "message"),
    [
        (truediv, (1, 0), ZeroDivisionError, "division"),
        (refuse, (), InputError, "^log: wanted rows, found none; record some"),
        (fail_oddly, (), RuntimeError, "^Unpicklable: 1 and 2"),
        (bytes, (1 << 62,), MemoryError, None),
        (ended_by, (signal.SIGKILL, LARGE), ToolFailed, "killed by signal 9"),
        (sys.exit, (7,), ToolFailed, "exit status 7"),
    ],
)
def test_the_first_failure_ends_it(work, arguments, error, message) -> None:
    """Also of processes that are stopped, or would rather be asked first."""
    others = [(k, ended_by, (signal.SIGSTOP, LARGE)) for k in range(3)]
    with pytest.raises(error, match=message) as caught:
        list(dispatch(2, [("bad", work, arguments), *others]))
    if error is not ToolFailed:
        assert "Traceback" in caught.value.__notes__[0]


def test_left_alone_it_ends() -> None:
    results = dispatch(2, [("good", truediv, (1, 2)), ("never", ended_by, (signal.SIGSTOP,))])
    assert next(results) == ("good", 0.5)
    results.close()
