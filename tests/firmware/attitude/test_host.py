"""Firmware sources on this computer, under the sanitizers: text, merging of missed updates."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from boresight.firmware.attitude.image import source
from boresight.gateware.description import describe
from boresight.gateware.texts.records import records_header
from boresight.model.attitude import estimator
from boresight.sim.levels.build import Build

FLAGS = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Werror",
    "-O1",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
)

#: Devices of a computer that has none: memory.
SOC = """
#ifndef SOC_REGISTERS_H
#define SOC_REGISTERS_H
#include <stdint.h>
extern uint32_t slot_words[4096];
extern uint32_t control_words[8];
#define SOC_CONTROL_BASE ((uintptr_t) control_words)
#define SOC_SLOT_BASE ((uintptr_t) slot_words)
#define SOC_WATCHDOG_KICK UINT32_C(1)
#define SOC_CYCLES_ADDR 0
#define SOC_CONSOLE_ADDR 3
#define SOC_STATUS_ADDR 4
#define SOC_STATUS_DEVICE UINT32_C(1)
#define SOC_WATCHDOG_ADDR 5
#endif
"""

REGISTERS = """
#include <stdint.h>
#define CORE_RESULT_HEADER_ADDR 0
#define CORE_RESULT_STAMP_ADDR 1
#define CORE_TIME_ADDR 2
#define CORE_RESULT_HEADER_FILTER_LSB 16
#define CORE_RESULT_HEADER_FILTER_WIDTH 3
#define CORE_RESULT_HEADER_FIELD_USED UINT32_C(0x80000)
static inline int32_t core_reg_signed(uint32_t bits) { return (int32_t) bits; }
static inline uint32_t core_reg_field(uint32_t bits, unsigned lsb, unsigned width)
{ return bits >> lsb & ((UINT32_C(1) << width) - 1u); }
"""


#: Two filters whose records are the same.
FILTERS = Build(estimator("mekf"), estimator("complementary"), restarts=0).core
RECORDS = records_header(describe(FILTERS).programs, outputs=16, inputs=32)


def run(main: str, files: tuple[str, ...], folder: Path) -> list[str]:
    """Lines that a program prints."""
    texts = {name: source(name) for name in (*files, "soc.h", "text.h", "attitude.h")}
    for name, text in {
        **texts,
        "soc_registers.h": SOC,
        "registers.h": REGISTERS,
        "records.h": RECORDS,
        "main.c": main,
    }.items():
        (folder / name).write_text(text)
    subprocess.run(["gcc", *FLAGS, *files, "main.c", "-o", "main"], cwd=folder, check=True)
    done = subprocess.run(["./main"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")


def test_numbers_as_text(tmp_path: Path) -> None:
    values = [0, 1, -1, 99, 100, -100, 123456, -18000, 2**31 - 1, -(2**31)]
    words = [
        (0, 31),
        (2**30, 31),
        (-(2**31), 31),
        (2**31 - 1, 31),
        (-1, 31),
        (1 << 20, 24),
        (5965232, 31),
        (-5965232, 31),
        (5965233, 31),
        (-7, 0),
    ]
    calls = "".join(
        f"text_hundredths({v if v > -(2**31) else 'INT32_MIN'}); text_end();\n" for v in values
    )
    calls += "".join(
        "text_hundredths(text_hundredths_of_half_turns("
        f"{w if w > -(2**31) else 'INT32_MIN'}, {f}u)); text_end();\n"
        for w, f in words
    )
    numbers = [
        (0, 5),
        (2**30, 31),
        (-(2**31), 31),
        (12345, 0),
        (-7, -3),
        (2**31 - 1, -40),
        (-1, -40),
        (1, 100),
        (-(2**31), 32),
        (327, 8),
    ]
    calls += "".join(
        f"text_hundredths(text_hundredths_of({w if w > -(2**31) else 'INT32_MIN'}, {f}));"
        " text_end();\n"
        for w, f in numbers
    )
    lines = run(
        """
#include "soc.h"
#include "text.h"
#include <stdio.h>
void soc_put(uint8_t byte) { if (byte != 13) { putchar(byte); } }
int main(void) {
    text_unsigned(UINT32_MAX); text_end();
"""
        + calls
        + "return 0;\n}\n",
        ("text.c",),
        tmp_path,
    )
    assert lines[0] == "4294967295"
    assert lines[1:11] == [
        f"{'-' if v < 0 else ''}{abs(v) // 100}.{abs(v) % 100:02d}" for v in values
    ]
    for text, (word, frac) in zip(lines[11:21], words, strict=True):
        exact = 180.0 * word / 2**frac
        assert abs(float(text) - exact) <= 0.005 + 1e-9, (word, frac)
    most = (2**31 - 1) / 100
    for text, (word, frac) in zip(lines[21:31], numbers, strict=True):
        exact = max(-most, min(most, word * 2.0**-frac))
        assert abs(float(text) - exact) <= 0.005 + 1e-9, (word, frac)


ATTITUDE = """
#include "attitude.h"
#include "registers.h"
#include "soc.h"
#include <stdio.h>
uint32_t slot_words[4096];
uint32_t control_words[8];
uint32_t soc_mask(void) { return 7u; }
void soc_unmask(uint32_t mask) { if (mask != 7u) { printf("mask\\n"); } }
static attitude_t got;
static uint32_t filter;
static void sample(uint32_t number, int32_t dt, int32_t field) {
    slot_words[0] = number | filter << 16 | (field != 0 ? CORE_RESULT_HEADER_FIELD_USED : 0u);
    slot_words[1] = 100u * number;
    slot_words[2] = 100u * number + 30u;
    for (uint32_t k = 0; k < 8u; k++) { slot_words[16u + k] = 1000u * number + k; }
    for (uint32_t k = 0; k < 10u; k++) { slot_words[32u + k] = 0u; }
    slot_words[32] = (uint32_t) dt;
    slot_words[36] = (uint32_t) field;
    attitude_interrupt();
}
static void show(void) {
    if (!attitude_take(&got)) { printf("none\\n"); return; }
    printf("%u %u %d %d dt %d field %d missed %u\\n",
        (unsigned) got.header & 0xffffu, (unsigned) got.age, (int) got.outputs[0],
        (int) got.outputs[7], (int) got.inputs[0], (int) got.inputs[4],
        (unsigned) attitude_missed());
}
int main(void) {
    show();
    sample(1, -5, 0); show(); show();
    sample(2, 10, 3); show();
    sample(3, 10, 4); sample(4, 11, 0); show();
    sample(5, 10, 4); sample(6, 11, 9); sample(7, 12, 0); show();
    sample(8, 10, 4); sample(9, -1, 0); show();
    sample(10, -2, 6); sample(11, 10, 0); show();
    sample(12, INT32_MAX - 3, 0); sample(13, 10, 0); show();
    for (uint32_t n = 14; n < 40u; n++) { sample(n, 1, 0); if (n % 3u == 0u) { show(); } }
    sample(40, 10, 4); filter = 1u; sample(41, 7, 0); show();
    return 0;
}
"""


def test_missed_updates_lose_neither_time_nor_field(tmp_path: Path) -> None:
    lines = run(ATTITUDE, ("attitude.c",), tmp_path)
    assert lines[:9] == [
        "none",
        "1 30 1000 1007 dt -5 field 0 missed 0",
        "none",
        "2 30 2000 2007 dt 10 field 3 missed 0",
        "4 30 4000 4007 dt 21 field 4 missed 1",
        "7 30 7000 7007 dt 33 field 9 missed 3",
        "9 30 9000 9007 dt -1 field 0 missed 4",
        "11 30 11000 11007 dt -2 field 6 missed 5",
        "13 30 13000 13007 dt 2147483647 field 0 missed 6",
    ]
    # What was missed of one estimator is nothing to the next one.
    assert lines[18].startswith("41 30 41000 41007 dt 7 field 0 ")
    assert [line.split(" missed")[0] for line in lines[9:11]] == [
        "15 30 15000 15007 dt 2 field 0",
        "18 30 18000 18007 dt 3 field 0",
    ]


def test_copy_is_not_disturbed(tmp_path: Path) -> None:
    """Interrupts between the choice of the newest update and its copy."""
    main = ATTITUDE.replace(
        'void soc_unmask(uint32_t mask) { if (mask != 7u) { printf("mask\\n"); } }',
        "static void sample(uint32_t number, int32_t dt, int32_t field);\n"
        "void soc_unmask(uint32_t mask) {\n"
        "    for (uint32_t n = 0; n < 5u; n++) { sample(100u + n + mask - 7u, 1, 0); }\n}",
    )
    assert "100u + n" in main
    main = main.split("int main")[0] + "int main(void) { sample(1, 5, 0); show(); show(); }\n"
    assert run(main, ("attitude.c",), tmp_path)[:2] == [
        "1 30 1000 1007 dt 5 field 0 missed 4",
        "104 30 104000 104007 dt 5 field 0 missed 8",
    ]


def test_update_that_changes_while_it_is_read(tmp_path: Path) -> None:
    """Three attempts, then it counts as missed; nothing is taken."""
    main = (
        ATTITUDE.split("int main")[0]
        + """
int main(void) {
    sample(1, 5, 0);
    show();
    slot_words[0] = 2u;
    moving = 1;
    attitude_interrupt();
    show();
    printf("%u\\n", (unsigned) attitude_missed());
    return 0;
}
"""
    )
    # Every reading of the header gives another number.
    registers = REGISTERS.replace(
        "#define CORE_RESULT_HEADER_ADDR 0",
        "extern uint32_t slot_words[4096];\nextern int moving;\n"
        "static inline unsigned header_at(void) { slot_words[0] += (uint32_t) moving; return 0; }\n"
        "#define CORE_RESULT_HEADER_ADDR header_at()",
    )
    main = main.replace("static attitude_t got;", "int moving;\nstatic attitude_t got;")
    for name, text in {
        "registers.h": registers,
        "records.h": RECORDS,
        "soc_registers.h": SOC,
        "main.c": main,
        **{n: source(n) for n in ("soc.h", "attitude.h", "attitude.c")},
    }.items():
        (tmp_path / name).write_text(text)
    subprocess.run(["gcc", *FLAGS, "attitude.c", "main.c", "-o", "main"], cwd=tmp_path, check=True)
    said = subprocess.run(["./main"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert said.stdout.splitlines() == ["1 30 1000 1007 dt 5 field 0 missed 0", "none", "1"]


@pytest.mark.parametrize(
    "name", ["soc.c", "attitude.c", "software.c", "text.c", "main.c", "measure.c"]
)
def test_lines_are_short_and_end_marked(name: str) -> None:
    text = source(name)
    assert max(map(len, text.splitlines())) <= 100
    assert text.endswith("// End of file\n")
