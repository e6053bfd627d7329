"""Four files of one declaration, each in its own language, with the same registers."""

import json
import xml.etree.ElementTree as ET

from boresight.gateware.registers.core import FIXED, program_choice
from boresight.gateware.registers.files import files_of
from boresight.gateware.registers.model import RegisterMap

REGISTERS = RegisterMap("two", "d1", 26, (3, 4), (*FIXED, program_choice(("slow", "fast"))), ())


def test_every_form_under_its_own_name() -> None:
    texts = files_of(REGISTERS)
    assert list(texts) == ["registers.h", "registers.json", "registers.md", "registers.svd"]
    names = [r.name for r in REGISTERS.registers]
    assert [r["name"] for r in json.loads(texts["registers.json"])["registers"]] == names
    svd = ET.fromstring(texts["registers.svd"])
    assert [r.findtext("name") for r in svd.iter("register")] == [n.upper() for n in names]
    for register in REGISTERS.registers:
        address = register.address
        assert f"#define TWO_{register.name.upper()}_ADDR {address}\n" in texts["registers.h"]
        assert f"| {address} | `{register.name}` |" in texts["registers.md"]
