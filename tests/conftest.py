"""Shared by all tests: the same cases in every run; no simulated bench waits for ever."""

import gc
import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from amaranth.sim import Simulator
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import none

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # There is a process for each processor.

from boresight.firmware import build
from boresight.model.errors import ToolMissing

#: Cycles after which a bench has failed, and the simulator's steps in each: two edges.
CYCLES, STEPS = 100_000, 2

#: Whose tests compile C as users do.
FIRMWARE = Path(__file__).with_name("firmware")

#: Properties: the same cases in every run, and nothing that depends on how busy the machine is;
#: `--hypothesis-profile=soak` draws many new ones.
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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Generator[None, Any, Any]:
    """Skip a test of a tool that is not installed; `-ra` shows the line that installs it."""
    try:
        return (yield)
    except ToolMissing as error:
        pytest.skip(str(error))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup() -> Generator[None, Any, Any]:
    """Skip a test whose fixture needs a tool that is not installed."""
    try:
        return (yield)
    except ToolMissing as error:
        pytest.skip(str(error))


def pytest_collection_finish() -> None:
    """What is there now stays, and is not searched for garbage again."""
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

    C is compiled as fast as it can be, but for what is about C (`tests/firmware`).
    """

    def run(simulator: Simulator) -> None:
        steps = 0
        while simulator.advance():
            steps += 1
            if steps > STEPS * CYCLES:
                raise TimeoutError(f"the bench has not ended after {CYCLES} cycles")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Simulator, "run", run)
        if FIRMWARE not in item.path.parents:
            patch.setattr(build, "CFLAGS", ("-O0",))
        return (yield)
