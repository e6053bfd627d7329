"""A registers.json read back: what `boresight compile` writes, and every way in which it is not."""

from __future__ import annotations

import json
import re

import pytest

from boresight.gateware.registers.core import FIXED, program_choice
from boresight.gateware.registers.files import files_of
from boresight.gateware.registers.model import RegisterMap
from boresight.model.errors import InputError
from boresight.register_file import read_registers

GAIN = {
    **{"name": "gain", "address": 4095, "access": "read-write", "unit": "1/s", "frac": -128},
    **{"width": 32, "minimum": -(2**31), "maximum": 2**32 - 1, "reset": 0, "signed": True},
    "names": ["slow", "fast"],
    "fields": [{"name": "a", "bit": 31, "width": 1}],
}
GOOD = {"registers": [GAIN], "programs": [{"outputs": [{"name": "qw", "frac": 29}]}]}


@pytest.fixture
def read(tmp_path):
    def of(data):
        path = tmp_path / "registers.json"
        path.write_text(data if isinstance(data, str) else json.dumps(data))
        return read_registers(path)

    return of


def test_what_compile_writes(read) -> None:
    registers = RegisterMap("core", "0", 32, (1, 2), (*FIXED, program_choice(("a", "b"))), ())
    data = read(files_of(registers)["registers.json"])
    assert [r["name"] for r in data["registers"]] == [r.name for r in registers.registers]


def test_the_most_that_may_be_there(read) -> None:
    assert read(GOOD) == GOOD
    assert read({"registers": [{"name": "x", "address": 0}]})["registers"]
    assert read({"registers": [{**GAIN, "width": None}]})["registers"]


@pytest.mark.parametrize(
    ("key", "value", "found"),
    [
        ("name", None, "nothing"),
        ("name", 5, "5"),
        ("address", None, "nothing"),
        ("address", 4096, "4096"),
        ("address", -1, "-1"),
        ("address", True, "true"),
        ("access", 1, "1"),
        ("unit", ["m"], "a list"),
        ("frac", -129, "-129"),
        ("frac", 129, "129"),
        ("frac", 1.0, "1.0"),
        ("width", 0, "0"),
        ("width", 33, "33"),
        ("minimum", -(2**31) - 1, "-2147483649"),
        ("maximum", 2**32, "4294967296"),
        ("reset", "0", "'0'"),
        ("signed", 1, "1"),
        ("names", "ab", "'ab'"),
        ("names", [1], "a list"),
        ("fields", [{"name": "a", "bit": 32, "width": 1}], "a list"),
        ("fields", [{"name": "a", "bit": 0, "width": 0}], "a list"),
        ("fields", [{"bit": 0, "width": 1}], "a list"),
        ("fields", {}, "an object"),
    ],
)
def test_what_a_register_may_not_be(key, value, found, read) -> None:
    message = f"registers[1], {key}: wanted a registers.json of `boresight compile`, found {found} "
    with pytest.raises(InputError, match=re.escape(message)):
        read({"registers": [GAIN, {**GAIN, key: value}]})


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "registers.json: wanted a registers.json of `boresight compile`, found a list;"),
        ({}, "registers.json, registers: wanted .*, found nothing there;"),
        ({"registers": {}}, "registers.json, registers: wanted .*, found an object there;"),
        ({"registers": [1]}, r"registers.json, registers\[0\]: wanted .*, found 1 there;"),
        ({**GOOD, "programs": 1}, "registers.json, programs: wanted .*, found 1 there;"),
        ({**GOOD, "programs": [{}]}, "registers.json, programs: wanted .*, found a list there;"),
        (
            {**GOOD, "programs": [{"outputs": [{"name": "qw"}]}]},
            "registers.json, programs: wanted .*, found a list there; give the file of this boa",
        ),
        (
            {"registers": [{"name": "clock_hz", "address": 0, "reset": 0}]},
            r"registers\[0\], reset: wanted .*, found 0 there;",
        ),
    ],
)
def test_what_is_no_register_map(data, message, read) -> None:
    with pytest.raises(InputError, match=message):
        read(data)
