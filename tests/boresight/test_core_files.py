"""Names of the files of a core; test_files.py and verbs/test_compile.py find them written."""

from __future__ import annotations

from boresight.core_files import core_files, project_files
from boresight.gateware.texts.core import integration_names

REGISTERS = {"registers.h", "registers.json"}


def test_one_program_needs_no_name_in_its_files() -> None:
    names = core_files(["my-filter"])
    assert len(names) == len(set(names))
    assert set(names) - REGISTERS - set(integration_names(generic=False, axi=False)) == {
        *("core.v", "report.json"),
        *(f"firmware/my_filter{end}" for end in (".c", ".h")),
    }


def test_a_target_without_primitives_needs_no_other_verilog() -> None:
    generic = core_files(["a"], target="generic")
    assert set(core_files(["a"])) - set(generic) == {"spartan6.v"} and "core.v" in generic
    assert (
        "core_axi.v" in core_files(["a"], target="generic", axi=True)
        and "core_axi.v" not in generic
    )


def test_several_have() -> None:
    more = set(core_files(["a", "b-c"])) - set(core_files(["a"]))
    assert more == {f"firmware/b_c{end}" for end in (".c", ".h")}


def test_only_the_system_has_registers_of_its_own() -> None:
    records, system = (set(project_files("papilio_pro", system=x)) for x in (False, True))
    assert system - records == {f"ise-papilio_pro/{name}" for name in REGISTERS}
    assert records < system and len(records) == 9
    assert {name.partition("/")[0] for name in system} == {"ise-papilio_pro"}
