"""The Markdown page: every register, tables that are tables."""

import dataclasses
import re

import pytest

from boresight.gateware.core import build_core
from boresight.gateware.register_map import register_map
from boresight.gateware.registers.core import FIXED
from boresight.gateware.registers.page import to_markdown
from boresight.model.estimators.complementary import Complementary


@pytest.fixture(scope="module")
def registers():
    return register_map(build_core(Complementary().compile(), "small", restarts=2))


def test_every_register(registers) -> None:
    text = to_markdown(registers)
    assert text == to_markdown(registers)
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
    streams = registers.streams[0]
    odd = dataclasses.replace(
        registers,
        streams=(
            dataclasses.replace(
                streams,
                inputs=tuple(dataclasses.replace(port, unit="a|b") for port in streams.inputs),
            ),
        ),
    )
    for table in re.findall(r"(?m)(?:^\|.*\n)+", to_markdown(odd)):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.splitlines()}) == 1
