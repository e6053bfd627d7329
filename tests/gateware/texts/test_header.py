"""The C header: compiles without a warning, also beside the firmware's; its numbers are right."""

import dataclasses
import itertools
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.build import find_compiler
from boresight.firmware.emit import emit_c
from boresight.gateware.core import build_core
from boresight.gateware.description import Description, Records, Word, describe
from boresight.gateware.registers.core import FIXED
from boresight.gateware.registers.model import Access, Register
from boresight.gateware.texts.core import c_header
from boresight.model.estimators.complementary import Complementary

FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
WORDS = (18, 24, 31, 32)


def by_hand(word: int) -> Description:
    """Names, texts and ranges that are hard to write down."""
    low, high = -(1 << word - 1), (1 << word - 1) - 1

    def parameter(name: str, address: int, frac: int, **more) -> Register:
        return Register(
            name,
            address,
            Access.WRITE_ONLY,
            **{
                "meaning": "a parameter",
                "unit": "1/s",
                "frac": frac,
                "low": low * 2.0**-frac,
                "high": high * 2.0**-frac,
                "minimum": low,
                "maximum": high,
                "reset": -1,
                **more,
            },
        )

    return Description(
        name="3 names",
        digest="ab" * 32,
        word=word,
        build=((1 << word) - 1, 1),
        registers=(
            parameter("status", 0, 3),
            parameter("Status", 1, -7),
            parameter("in_u", 2, 40, meaning="ends */ here \\", unit="?/*?\\"),
            parameter("int", 3, 0, unit="m|s"),
            *FIXED,
        ),
        programs=(
            Records(
                "3 names",
                "ab" * 32,
                (Word("u", 17, "m"), Word("U", -2, "")),
                (Word("int", 1, "*/"),),
            ),
        ),
    )


def run(folder: Path, source: str) -> list[int]:
    """Numbers that a program prints."""
    (folder / "main.c").write_text(source)
    subprocess.run([find_compiler(), *FLAGS, "main.c", "-o", "main"], cwd=folder, check=True)
    done = subprocess.run([folder / "main"], capture_output=True, text=True, check=True)
    return [int(number) for number in done.stdout.split()]


def show(names: list[str]) -> str:
    """A program that prints macros."""
    calls = "".join(f'printf("%lld\\n", (long long){name});\n' for name in names)
    return f"#include <stdio.h>\nint main(void) {{ {calls} return 0; }}\n"


def test_every_parameter_of_the_complementary_filter(tmp_path) -> None:
    core = build_core(Complementary().compile(), "fast", restarts=2)
    registers = describe(core)
    text = c_header(registers)
    assert text == c_header(describe(core))
    (tmp_path / "registers.h").write_text(text)
    names, expected = [], []
    for param, register in zip(Complementary.params, registers.parameters, strict=True):
        form = core.program.format(core.program.find(param.name))
        for suffix, value in (
            ("ADDR", core.parameter_addresses[param.name]),
            ("FRAC", form.frac),
            ("MIN", int(form.quantise(param.low))),
            ("MAX", int(form.quantise(param.high))),
            ("DEFAULT", int(form.quantise(param.default))),
        ):
            names.append(f"COMPLEMENTARY_{param.name.upper()}_{suffix}")
            expected.append(value)
        unit = f" {register.unit}" if register.unit else ""
        assert f"_{param.name.upper()}_MAX {expected[-2]} // {param.high:g}{unit}\n" in text
    names += [
        "COMPLEMENTARY_BUILD_LOW_VALUE",
        "COMPLEMENTARY_STATUS_FRAMING",
        "COMPLEMENTARY_UPDATES_ADDR",
        "COMPLEMENTARY_IN_DT_FRAC",
        "COMPLEMENTARY_OUT_QW_FRAC",
    ]
    expected += [
        core.image.digest & 0xFFFFFFFF,
        2,
        513,
        registers.programs[0].inputs[0].frac,
        registers.programs[0].outputs[3].frac,
    ]
    assert run(tmp_path, '#include "registers.h"\n' + show(names)) == expected


@pytest.mark.parametrize("first", [0, 1])
def test_beside_the_firmware(first: int, tmp_path) -> None:
    program = Complementary().compile(word=28)
    files = emit_c(program)
    files["registers.h"] = c_header(describe(build_core(program, "small", restarts=2)))
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    headers = ["complementary.h", "registers.h"]
    includes = "".join(f'#include "{headers[k]}"\n' for k in (first, 1 - first, first))
    assert run(tmp_path, includes + show(["COMPLEMENTARY_WORD"])) == [28]


@pytest.mark.parametrize("word", WORDS)
def test_hard_names_and_ranges(word: int, tmp_path) -> None:
    registers = by_hand(word)
    (tmp_path / "registers.h").write_text(c_header(registers))
    stems = ["STATUS_2", "STATUS_3", "IN_U", "INT"]
    names = [
        f"N3_NAMES_{stem}_{suffix}"
        for stem, suffix in itertools.product(stems, ("ADDR", "FRAC", "MIN", "MAX", "DEFAULT"))
    ]
    expected = [
        value
        for r in registers.parameters
        for value in (r.address, r.frac, r.minimum, r.maximum, r.reset)
    ]
    names += [
        "N3_NAMES_STATUS_ADDR",
        "N3_NAMES_IN_U_2_FRAC",
        "N3_NAMES_IN_U_3_FRAC",
        "N3_NAMES_BUILD_LOW_VALUE",
    ]
    expected += [512, 17, -2, (1 << word) - 1]
    assert run(tmp_path, '#include "registers.h"\n' + show(names)) == expected


@pytest.mark.parametrize("word", WORDS)
def test_accessors(word: int, tmp_path) -> None:
    (tmp_path / "r.h").write_text(c_header(dataclasses.replace(by_hand(word), name="r")))
    low, high = -(1 << word - 1), (1 << word - 1) - 1
    values = [low, low + 1, -2, -1, 0, 1, high - 1, high]
    mask = (1 << word) - 1
    garbage = 0xFFFFFFFF & ~mask
    lines = []
    for value in values:
        text = "INT32_MIN" if value == -(2**31) else str(value)
        lines.append(
            f"r_reg_write(memory, R_IN_U_ADDR, {text});"
            f"show(memory[2]); show(r_reg_read_signed(memory, R_IN_U_ADDR));"
            f"memory[2] |= UINT32_C({garbage}); show(r_reg_read(memory, 2));"
            f"show(r_reg_signed(memory[2]));"
        )
    source = (
        '#include "r.h"\n#include <stdio.h>\n'
        'static void show(long long x) { printf("%lld\\n", x); }\n'
        "int main(void) { static uint32_t memory[1024];\n" + "\n".join(lines) + "return 0; }\n"
    )
    assert run(tmp_path, source) == [
        x for value in values for x in (value & mask, value, value & mask, value)
    ]
