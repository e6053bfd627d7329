"""The register map as C header, SVD and page: each in its own language, with every register."""

import dataclasses
import itertools
import re
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from boresight.firmware.build import find_compiler
from boresight.firmware.emit import emit_c
from boresight.gateware.core import Core, build_core, build_shared_core
from boresight.gateware.description import Description, Records, Word, describe
from boresight.gateware.registers.core import FIXED
from boresight.gateware.registers.model import Access, Register
from boresight.gateware.texts.core import c_header, register_files
from boresight.model.attitude.complementary import Complementary
from tests.support.random_program import random_programs

FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
WORDS = (18, 24, 31, 32)


#: Order of the elements in CMSIS-SVD 1.3.
ORDER = {
    "device": [
        "vendor",
        "name",
        "version",
        "description",
        "addressUnitBits",
        "width",
        "size",
        "access",
        "resetValue",
        "resetMask",
        "peripherals",
    ],
    "peripheral": ["name", "description", "baseAddress", "addressBlock", "registers"],
    "addressBlock": ["offset", "size", "usage"],
    "register": [
        "name",
        "description",
        "addressOffset",
        "size",
        "access",
        "resetValue",
        "resetMask",
        "writeConstraint",
        "fields",
    ],
    "range": ["minimum", "maximum"],
    "field": [
        "name",
        "description",
        "bitOffset",
        "bitWidth",
        "access",
        "modifiedWriteValues",
        "enumeratedValues",
    ],
    "enumeratedValue": ["name", "value"],
}


@pytest.fixture(scope="module")
def core() -> Core:
    return build_core(Complementary().compile(word=24), "small")


@pytest.fixture(scope="module")
def registers(core: Core) -> Description:
    return describe(core)


def page(registers: Description) -> str:
    return register_files(registers)["registers.md"]


def svd(registers: Description) -> ET.Element:
    device = ET.fromstring(register_files(registers)["registers.svd"])
    for element in device.iter():
        if element.tag in ORDER:
            places = [ORDER[element.tag].index(child.tag) for child in element]
            assert places == sorted(set(places)), element.tag
    return device


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


def test_all_forms_have_the_same_registers(registers: Description) -> None:
    files = register_files(registers)
    names = [r.name.upper() for r in registers.registers]
    assert [r.findtext("name") for r in svd(registers).iter("register")] == names
    for register in registers.registers:
        name, address = register.name, register.address
        assert f"#define COMPLEMENTARY_{name.upper()}_ADDR {address}\n" in files["registers.h"]
        assert f"| {address} | `{name}` |" in files["registers.md"]
    for end, text in files.items():
        assert Complementary.params[0].meaning in text, end


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
    files = {**emit_c(core.program), "registers.h": c_header(describe(core))}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    headers = ["complementary.h", "registers.h"]
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


def test_svd_of_every_parameter(registers: Description) -> None:
    device = svd(registers)
    assert device.findtext(".//baseAddress") == "0x00000000"
    results = {r.findtext("name"): r for r in device.iter("register")}
    for param, register in zip(Complementary.params, registers.parameters, strict=True):
        element = results[param.name.upper()]
        assert int(element.findtext("addressOffset"), 16) == 4 * register.address
        assert element.findtext("access") == "write-only"
        assert int(element.findtext("resetValue"), 16) == register.reset & 0xFFFFFF
        assert int(element.findtext("resetMask"), 16) == 0xFFFFFF
        assert element.findtext("description").startswith(param.meaning)
        assert element.findtext("fields/field/bitWidth") == "24"
        limits = element.find("writeConstraint/range")
        assert (limits is None) == (param.low < 0)
        if limits is not None:
            assert int(limits.findtext("maximum")) == register.maximum
    status = {f.findtext("name"): f for f in results["STATUS"].iter("field")}
    assert [(name, int(f.findtext("bitOffset"))) for name, f in status.items()] == [
        (f.name.upper(), f.bit) for f in FIXED[0].fields
    ]
    assert status["FRAMING"].findtext("modifiedWriteValues") == "oneToClear"
    assert status["IDLE"].findtext("access") == "read-only"
    assert int(results["BUILD_HIGH"].findtext("resetValue"), 16) == registers.build[1]


def test_svd_of_texts_with_marks(registers: Description) -> None:
    first, *others = registers.registers
    odd = dataclasses.replace(first, meaning='<a> & "b"', unit="x&y")
    device = svd(dataclasses.replace(registers, registers=(odd, *others)))
    text = device.findtext(".//registers/register/description") or ""
    assert text.startswith('<a> & "b"; value = signed word * 2^') and " x&y, " in text


def test_svd_enumerates_programs() -> None:
    core = build_shared_core(random_programs(2, 3), "small")
    device = svd(describe(core))
    register = next(r for r in device.iter("register") if r.findtext("name") == "PROGRAM")
    assert register.findtext("addressOffset") == hex(4 * 516)
    assert register.findtext("access") == "read-write"
    assert [
        (e.findtext("name"), e.findtext("value")) for e in register.iter("enumeratedValue")
    ] == [("RANDOM0", "0"), ("RANDOM1", "1"), ("RANDOM2", "2")]
    names = [r.findtext("name") for r in device.iter("register")]
    assert len(set(names)) == len(names)
    assert any(name.startswith("RANDOM2_PARAM") for name in names)


def test_page_of_every_parameter(registers: Description) -> None:
    text = page(registers)
    for param in Complementary.params:
        register = registers.find(param.name)
        number, default = register.address, register.reset * 2.0**-register.frac
        assert re.search(
            rf"(?m)^\| {number} \| `{param.name}` \| `fixed<24,\d+>` \| "
            rf"{re.escape(param.unit)} \| {param.low:g} to {param.high:g} \| "
            rf"{default:.6g} \| {re.escape(param.meaning)} \|$",
            text,
        ), param.name
    for register in FIXED:
        assert f"| {register.address} | `{register.name}` |" in text
    for name in ("dt", "az", "pitch", "status"):
        assert f"| `{name}` |" in text


def test_tables_have_equal_rows(registers: Description) -> None:
    records = registers.programs[0]
    odd = dataclasses.replace(
        registers,
        programs=(
            dataclasses.replace(
                records,
                inputs=tuple(dataclasses.replace(port, unit="a|b") for port in records.inputs),
            ),
        ),
    )
    for table in re.findall(r"(?m)(?:^\|.*\n)+", page(odd)):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1
