"""The register map as CMSIS-SVD."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from boresight.gateware.registers.model import Access, Register, RegisterMap
from boresight.model.tools.c_names import identifier, unique

__all__ = ["to_svd"]


def to_svd(registers: RegisterMap, *, base_address: int = 0) -> str:
    """A CMSIS-SVD 1.3 description, for a bus that is mapped to memory at ``base_address``."""
    if not isinstance(base_address, int) or not 0 <= base_address < 2**32 or base_address % 4:
        raise ValueError(
            f"base_address must be a multiple of 4 from 0 to 2^32 - 4, not {base_address!r}"
        )
    name, names = identifier(registers.name), registers.identifiers
    device = ET.Element(
        "device",
        {
            "schemaVersion": "1.3",
            "xmlns:xs": "http://www.w3.org/2001/XMLSchema-instance",
            "xs:noNamespaceSchemaLocation": "CMSIS-SVD.xsd",
        },
    )
    last = max(r.address for r in registers.registers)
    size = 0x1000 if last < 1024 else 4 << last.bit_length()
    _add(
        device,
        vendor="Boresight",
        name=f"{name}_{identifier(registers.title)}",
        version="1.0",
        description=f"{registers.title} {registers.name}, digest {registers.digest}",
        addressUnitBits=8,
        width=32,
        size=32,
        access="read-write",
        resetValue="0x0",
        resetMask="0x0",
    )
    peripheral = ET.SubElement(ET.SubElement(device, "peripherals"), "peripheral")
    _add(
        peripheral,
        name=name.upper(),
        description="parameters and status",
        baseAddress=f"{base_address:#010x}",
    )
    _add(
        ET.SubElement(peripheral, "addressBlock"),
        offset="0x0",
        size=f"{size:#x}",
        usage="registers",
    )
    parent = ET.SubElement(peripheral, "registers")
    known = dict(zip(("build_low", "build_high"), registers.build, strict=True))
    for register in registers.registers:
        element = ET.SubElement(parent, "register")
        reset = known.get(register.name) if register.reset is None else register.reset
        _register(element, register, names[register.address], reset, registers)
    ET.indent(device)
    text = ET.tostring(device, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def _register(
    element: ET.Element, register: Register, name: str, reset: int | None, registers: RegisterMap
) -> None:
    """A register, its value after power-up and its range."""
    _add(
        element,
        name=name.upper(),
        description=_description(register),
        addressOffset=f"{4 * register.address:#x}",
        size=32,
        access=register.access.value,
    )
    if reset is not None:
        mask = registers.mask_of(register)
        _add(element, resetValue=f"{reset & mask:#x}", resetMask=f"{mask:#x}")
    if register.minimum is not None and register.minimum >= 0:  # SVD has no negative limits
        limits = ET.SubElement(ET.SubElement(element, "writeConstraint"), "range")
        _add(limits, minimum=register.minimum, maximum=register.maximum)
    _fields(ET.SubElement(element, "fields"), register, registers.word)


def _fields(fields: ET.Element, register: Register, word: int) -> None:
    """The bits of a register; one field for all of it where they have no names."""
    if not register.fields:
        field = ET.SubElement(fields, "field")
        _add(field, name="WORD", bitOffset=0, bitWidth=register.width or word)
        if register.names:
            values = ET.SubElement(field, "enumeratedValues")
            for k, choice in enumerate(unique(register.names)):
                _add(ET.SubElement(values, "enumeratedValue"), name=choice.upper(), value=k)
    for bit in register.fields:
        field = ET.SubElement(fields, "field")
        access = Access.READ_WRITE if bit.clear else Access.READ_ONLY
        if register.access is Access.WRITE_ONLY:
            access = Access.WRITE_ONLY
        _add(
            field,
            name=bit.name.upper(),
            description=bit.meaning,
            bitOffset=bit.bit,
            bitWidth=bit.width,
            access=access.value,
        )
        if bit.clear:
            _add(field, modifiedWriteValues="oneToClear")


def _add(parent: ET.Element, **children: object) -> None:
    """Child elements with a text each."""
    for tag, value in children.items():
        ET.SubElement(parent, tag).text = str(value)


def _description(register: Register) -> str:
    """Meaning, format and range in words."""
    text = register.meaning
    if register.frac is not None:
        unit = f" {register.unit}" if register.unit else ""
        text += f"; value = signed word * 2^{-register.frac}{unit}"
        if register.low is not None:
            text += f", {register.low:g} to {register.high:g}"
    elif register.unit:
        text += f" [{register.unit}]"
    return text
