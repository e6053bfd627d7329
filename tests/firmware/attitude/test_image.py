"""Images: where things stand, and what is said when they do not fit."""

from __future__ import annotations

import shutil

import pytest

from boresight.firmware.attitude import image
from boresight.firmware.attitude.filter import filter_header
from boresight.firmware.attitude.image import COMPILER, ImageError, build_image, find_cross_compiler
from boresight.model.errors import ToolMissing

needs_compiler = pytest.mark.skipif(
    shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed (make firmware)"
)
HEADER = "".join(
    f"#define SOC_{name} 0\n"
    for name in (
        "CONTROL_BASE",
        "SLOT_BASE",
        "CYCLES_ADDR",
        "WATCHDOG_ADDR",
        "WATCHDOG_KICK",
        "FENCE_ADDR",
        "STATUS_ADDR",
        "STATUS_CONSOLE_FREE",
        "STATUS_CONSOLE_FULL",
        "CONSOLE_ADDR",
    )
)
MAIN = """
#include "soc.h"
uint32_t first = 7u;
static uint32_t none[50];
void soc_interrupt(const uint32_t pending) { none[0] = pending; }
int main(void) { return (int) (first + none[1]); }
"""


def make(text: str = MAIN, **options) -> image.Image:
    return build_image(
        {"main.c": text, "soc_registers.h": HEADER}, sources=("main.c",), **{"ram": 8192, **options}
    )


@needs_compiler
def test_where_things_stand() -> None:
    built = make()
    s = built.symbols
    assert s["_start"] == 0
    assert s["_fence_page"] * 1024 >= s["_image_end"]
    assert s["_data_begin"] == s["_fence_page"] * 1024
    assert s["_bss_begin"] >= s["_data_end"]
    assert s["_stack_bottom"] >= s["_bss_end"]
    assert s["_stack_top"] == 8192
    assert s["_stack_bottom"] % 16 == 0
    assert len(built.words) * 4 == built.code_size == s["_image_end"]
    assert built.words[s["_data_image"] // 4 + (s["first"] - s["_data_begin"]) // 4] == 7
    assert built.data_size >= 200
    assert built.hex.splitlines()[0] == f"{built.words[0]:08x}"


@needs_compiler
def test_same_sources_same_image() -> None:
    assert make() == make()


@needs_compiler
def test_memory_too_small() -> None:
    with pytest.raises(
        ImageError, match="^riscv64-unknown-elf-gcc failed: .*memory is full: no room for the stack"
    ):
        make(stack=8000)


@needs_compiler
def test_warning_is_an_error() -> None:
    with pytest.raises(ImageError, match=r"main\.c:\d+:\d+: error: .*unused"):
        make(MAIN + "static int unused;\n")


def test_missing_compiler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image.shutil, "which", lambda name: None)
    with pytest.raises(
        ToolMissing,
        match=r"^riscv64-unknown-elf-gcc was not found: run 'make "
        r"firmware', or install it \(Debian, Ubuntu: apt-get "
        r"install gcc-riscv64-unknown-elf picolibc-\S+\)$",
    ):
        find_cross_compiler()


def test_filter_header() -> None:
    assert "#define FILTER_KIND 0" in filter_header(None)
    text = filter_header("mekf")
    assert "#define FILTER_KIND 1" in text
    assert "typedef mekf_in_t filter_in_t;" in text
    assert "#define filter_update mekf_update" in text
    assert "#define FILTER_KIND 2" in filter_header("mekf_float", single=True)
