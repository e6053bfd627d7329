"""The register map as C header: what a compiler reads is what the core has."""

import dataclasses
import itertools
import re
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.build import find_compiler
from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core, build_core
from boresight.gateware.description import Description, Records, Word, describe
from boresight.gateware.registers import FIXED, Access, Register
from boresight.gateware.texts.core import register_files
from boresight.model.attitude.complementary import Complementary

FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
WORDS = (18, 24, 31, 32)


@pytest.fixture(scope="module")
def core() -> Core:
    return build_core(Complementary().compile(word=24), "small")


@pytest.fixture(scope="module")
def registers(core: Core) -> Description:
    return describe(core)


def c_header(core: Description) -> str:
    return register_files(core)["registers.h"]


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


def test_header_of_every_parameter(core: Core, registers: Description, tmp_path: Path) -> None:
    text = c_header(registers)
    (tmp_path / "registers.h").write_text(text)
    names, expected = [], []
    for param in Complementary.params:
        form = core.program.format(core.program.find(param.name))
        words = {
            "ADDR": core.parameter_addresses[param.name],
            "FRAC": form.frac,
            "MIN": int(form.quantise(param.low)),
            "MAX": int(form.quantise(param.high)),
            "DEFAULT": int(form.quantise(param.default)),
        }
        names += [f"COMPLEMENTARY_{param.name.upper()}_{suffix}" for suffix in words]
        expected += words.values()
        unit = f" {param.unit}" if param.unit else ""
        assert f"_{param.name.upper()}_MAX {words['MAX']} // {param.high:g}{unit}\n" in text
    (records,) = registers.programs
    others = {
        "BUILD_LOW_VALUE": core.image.digest & 0xFFFFFF,
        "STATUS_FRAMING": 2,
        "UPDATES_ADDR": 513,
        "IN_DT_FRAC": records.inputs[0].frac,
        "OUT_QW_FRAC": records.outputs[3].frac,
    }
    names += [f"COMPLEMENTARY_{name}" for name in others]
    expected += others.values()
    assert run(tmp_path, '#include "registers.h"\n' + show(names)) == expected


@pytest.mark.parametrize("first", [0, 1])
def test_header_beside_the_firmware(first: int, core: Core, tmp_path: Path) -> None:
    """Both name the same fraction bits in the same way, and one source can read both."""
    files = {**emit_c(core.program), "registers.h": c_header(describe(core))}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    headers = ["complementary.h", "registers.h"]
    formats = [{*re.findall(r"#define (\w+_FRAC \S+)", files[name])} for name in headers]
    assert formats[0] == formats[1]
    includes = "".join(f'#include "{headers[k]}"\n' for k in (first, 1 - first, first))
    assert run(tmp_path, includes + show(["COMPLEMENTARY_WORD"])) == [24]


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
