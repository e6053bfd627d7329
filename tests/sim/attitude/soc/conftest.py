"""Small C programs on the simulated soft core."""

import shutil
from collections.abc import Callable

import pytest

from boresight.firmware.attitude.image import COMPILER, Image, build_image
from boresight.gateware.attitude.soc.layout import soc_header
from boresight.sim.attitude.soc.measure import soc_bench
from boresight.sim.rtl.compiled import Compiled


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "without_compiler: compiles nothing for the soft core")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Firmware in C needs its compiler."""
    missing = shutil.which(COMPILER) is None
    skip = pytest.mark.skip(reason=f"{COMPILER} is not installed (make firmware)")
    for item in items:
        needs = item.get_closest_marker("without_compiler") is None
        if missing and needs and "sim/attitude/soc" in str(item.path):
            item.add_marker(skip)


@pytest.fixture(scope="session")
def bench() -> Compiled:
    """The bench that the measurements use too: 256 KB, a watchdog of 2^20 cycles."""
    return soc_bench()


@pytest.fixture
def program() -> Callable[[str], Image]:
    """Image of a C text that includes ``soc.h``."""

    def make(text: str, **options: object) -> Image:
        head = (
            '#include "soc.h"\n#include <string.h>\n'
            "#define SAY(k, word) (SOC_SLOT[(k)] = (uint32_t) (word))\n"
            "#define STATUS (SOC_CONTROL[SOC_STATUS_ADDR])\n"
            "#define END SOC_SLOT[2] = 1u; for (;;) { soc_kick(); }\n"
        )
        return build_image(
            {"main.c": head + text, "soc_registers.h": soc_header()},
            sources=("main.c",),
            ram=16 * 1024,
            **options,
        )  # type: ignore[arg-type]

    return make


@pytest.fixture
def run(bench: Compiled, program: Callable[[str], Image]) -> Callable[..., list[str]]:
    """Lines that the bench prints while a C text runs."""

    def go(text: str, **arguments: object) -> list[str]:
        done = bench.run(
            arguments,
            max_cycles=4_000_000,
            files={"firmware.hex": program(text).hex, "records.hex": "0000002a\n"},
        )
        return [
            line
            for line in done.stdout.splitlines()
            if line[:2] in ("V ", "O ", "T ", "W ", "I ", "D ")
        ]

    return go
