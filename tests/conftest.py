"""Shared by all tests: the same cases in every run; no simulated bench waits for ever."""

import gc
import signal
import sys
import threading
import traceback
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from amaranth.sim import Simulator
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import none

from boresight.firmware import build
from boresight.gateware import core

#: Cycles after which a bench has failed, and the simulator's steps in each: two edges.
CYCLES, STEPS = 100_000, 2

#: Whose tests compile C as users do.
FIRMWARE = Path(__file__).with_name("firmware")

#: Passes of the scheduler's search, where neither a test nor its marker says how many.
PASSES = 2

#: Properties: the same cases in every run, and nothing that depends on how busy the machine is;
#: `make soak` draws new ones (`--hypothesis-profile=soak`).
settings.register_profile(
    "everyday",
    derandomize=True,
    database=None,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "soak", settings.get_profile("everyday"), derandomize=False, max_examples=1000, print_blob=True
)
settings.load_profile("everyday")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", f"cycles(limit): cycles that a simulated bench may take, instead of {CYCLES}"
    )
    config.addinivalue_line(
        "markers", f"full_search: schedules as a user gets them, not after {PASSES} passes"
    )


class OutOfTime(BaseException):
    """A test has not ended in time.

    No `Exception`, and none of pytest's: hypothesis would catch it and run the case again.
    """


@pytest.hookimpl(optionalhook=True)
def pytest_timeout_set_timer(item: pytest.Item, settings: Any) -> bool:
    """Fail a test after its time (pytest-timeout), with the line where each thread stands."""

    def late(number: int, frame: object) -> None:
        threads = {t.ident: t.name for t in threading.enumerate()} | {threading.get_ident(): ""}
        places = [
            f"{threads[ident]} at {entry.filename}:{entry.lineno}"
            for ident, top in sys._current_frames().items()
            if threads.get(ident)
            for entry in traceback.extract_stack(top)[-1:]
        ]
        beside = f"; threads beside it: {', '.join(places)}" if places else ""
        raise OutOfTime(f"{item.nodeid} has not ended after {settings.timeout:g} s{beside}")

    signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, settings.timeout)
    return True


@pytest.hookimpl(optionalhook=True)
def pytest_timeout_cancel_timer() -> bool:
    """Stop the clock of `pytest_timeout_set_timer`."""
    signal.setitimer(signal.ITIMER_REAL, 0)
    return True


_schedule = core._schedule


def _brief(program: Any, machine: Any, urgent: Any, restarts: int | None, *key: Any) -> Any:
    """`gateware.core._schedule`, with few passes by default."""
    return _schedule(program, machine, urgent, PASSES if restarts is None else restarts, *key)


def pytest_collection_finish() -> None:
    """What is there now stays, and is not searched for garbage again (decision 0016)."""
    # Hypothesis looks for who holds its source of random numbers, which it makes at its first use.
    given(none())(lambda _: None)()
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """``Simulator.run`` fails where a bench, and whatever it waits for, does not end.

    A fault in a component mostly shows as something that never comes; without a limit the bench
    would hang, and with it the whole run of tests.

    Schedules are searched for briefly: each is proven by the same checks. C is compiled as fast as
    it can be, but for what is about C (`tests/firmware`).
    """
    marker = item.get_closest_marker("cycles")
    limit = marker.args[0] if marker else CYCLES

    def run(simulator: Simulator) -> None:
        steps = 0
        while simulator.advance():
            steps += 1
            if steps > STEPS * limit:
                raise TimeoutError(f"the bench has not ended after {limit} cycles")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Simulator, "run", run)
        if not item.get_closest_marker("full_search"):
            patch.setattr(core, "_schedule", _brief)
        if FIRMWARE not in item.path.parents:
            patch.setattr(build, "CFLAGS", ("-O0",))
        return (yield)
