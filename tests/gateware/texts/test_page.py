"""The Markdown page: every register, tables that are tables."""

import dataclasses
import re

import pytest

from boresight.gateware.core import build_core
from boresight.gateware.description import describe
from boresight.gateware.registers.core import FIXED
from boresight.gateware.texts.core import register_files
from boresight.model.estimators.complementary import Complementary


def page(registers) -> str:
    return register_files(registers)["registers.md"]


@pytest.fixture(scope="module")
def registers():
    return describe(build_core(Complementary().compile(), "small", restarts=2))


def test_every_register(registers) -> None:
    text = page(registers)
    for param in Complementary.params:
        number = registers.find(param.name).address
        assert re.search(
            rf"(?m)^\| {number} \| `{param.name}` \| `fixed<32,\d+>` \| "
            rf"{re.escape(param.unit)} \| {param.low:g} to {param.high:g} \| "
            rf"{param.default:g} \| {re.escape(param.meaning)} \|$",
            text,
        ), param.name
    for register in FIXED:
        assert f"| {register.address} | `{register.name}` |" in text
    for name in ("dt", "az", "pitch", "status"):
        assert f"| `{name}` |" in text


def test_tables_have_equal_rows(registers) -> None:
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
