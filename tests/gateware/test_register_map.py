"""The files of the register map: all of them, the same every time, of one declaration."""

import json
import subprocess
import sys
import xml.etree.ElementTree as ET

from boresight.gateware.core import build_core
from boresight.gateware.register_map import register_map, register_map_files
from boresight.model.estimators.complementary import Complementary

TEXT = """
from boresight.gateware.core import build_core
from boresight.gateware.register_map import register_map_files
from boresight.model.estimators.complementary import Complementary
core = build_core(Complementary().compile(word=26), "small", restarts=2)
print("".join(register_map_files(core).values()), end="")
"""


def files() -> dict[str, str]:
    return register_map_files(build_core(Complementary().compile(word=26), "small", restarts=2))


def test_the_same_in_another_process() -> None:
    done = subprocess.run(
        [sys.executable, "-c", TEXT],
        env={"PYTHONHASHSEED": "7"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "".join(files().values())


def test_all_forms_have_the_same_registers() -> None:
    texts = files()
    assert list(texts) == [f"registers.{end}" for end in ("h", "json", "md", "svd")]
    data = json.loads(texts["registers.json"])
    svd = ET.fromstring(texts["registers.svd"])
    header, page = texts["registers.h"], texts["registers.md"]
    assert [r.findtext("name") for r in svd.iter("register")] == [
        r["name"].upper() for r in data["registers"]
    ]
    for register in data["registers"]:
        name, address = register["name"], register["address"]
        assert f"#define COMPLEMENTARY_{name.upper()}_ADDR {address}\n" in header
        assert f"| {address} | `{name}` |" in page


def test_meanings() -> None:
    core = build_core(Complementary().compile(word=26), "small", restarts=2)
    for end, text in register_map_files(core).items():
        assert Complementary.params[0].meaning in text, end
    meanings = {p.name: p.meaning for p in Complementary.params}
    assert register_map(core).find("mag_gate").meaning == meanings["mag_gate"]
