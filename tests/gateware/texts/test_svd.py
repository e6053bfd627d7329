"""The SVD: well formed, in the schema's order, with every register."""

import xml.etree.ElementTree as ET

import pytest

from boresight.gateware.core import build_core, build_shared_core
from boresight.gateware.description import describe
from boresight.gateware.registers.core import FIXED
from boresight.gateware.texts.core import register_files
from boresight.model.estimators.complementary import Complementary
from tests.support.random_program import random_programs

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


def svd(registers) -> str:
    return register_files(registers)["registers.svd"]


@pytest.fixture(scope="module")
def registers():
    program = Complementary().compile(word=24)
    return describe(build_core(program, "small", restarts=2))


def test_every_register(registers) -> None:
    device = ET.fromstring(svd(registers))
    assert device.findtext(".//baseAddress") == "0x00000000"
    found = {r.findtext("name"): r for r in device.iter("register")}
    assert list(found) == [r.name.upper() for r in registers.registers]
    for param, register in zip(Complementary.params, registers.parameters, strict=True):
        element = found[param.name.upper()]
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
    status = {f.findtext("name"): f for f in found["STATUS"].iter("field")}
    assert [(name, int(f.findtext("bitOffset"))) for name, f in status.items()] == [
        (f.name.upper(), f.bit) for f in FIXED[0].fields
    ]
    assert status["FRAMING"].findtext("modifiedWriteValues") == "oneToClear"
    assert status["IDLE"].findtext("access") == "read-only"
    assert int(found["BUILD_HIGH"].findtext("resetValue"), 16) == registers.build[1]


def test_order_of_the_schema(registers) -> None:
    for element in ET.fromstring(svd(registers)).iter():
        if element.tag in ORDER:
            places = [ORDER[element.tag].index(child.tag) for child in element]
            assert places == sorted(set(places)), element.tag


def test_programs_are_enumerated() -> None:
    core = build_shared_core(random_programs(2, 3), "small", restarts=0)
    device = ET.fromstring(svd(describe(core)))
    for element in device.iter():
        if element.tag in ORDER:
            places = [ORDER[element.tag].index(child.tag) for child in element]
            assert places == sorted(set(places)), element.tag
    register = next(r for r in device.iter("register") if r.findtext("name") == "PROGRAM")
    assert register.findtext("addressOffset") == hex(4 * 516)
    assert register.findtext("access") == "read-write"
    assert [
        (e.findtext("name"), e.findtext("value")) for e in register.iter("enumeratedValue")
    ] == [("RANDOM0", "0"), ("RANDOM1", "1"), ("RANDOM2", "2")]
    names = [r.findtext("name") for r in device.iter("register")]
    assert len(set(names)) == len(names)
    assert any(name.startswith("RANDOM2_PARAM") for name in names)
