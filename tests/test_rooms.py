"""The shape of the tree: small rooms, no circles, short functions, a test for every module."""

from __future__ import annotations

from pathlib import Path
from textwrap import indent

import pytest

from tests.support.tree import (
    ROOT,
    SOURCES,
    circles,
    full_folders,
    long_functions,
    modules_of,
    unmirrored,
)

LONG: set[str] = {"gateware/sensors/hmr3300.py: elaborate", "sim/board/trace.py: read_trace"}


def test_no_folder_is_full():
    assert not full_folders()


def test_no_circle_among_modules():
    assert not circles(modules_of(), rooms=False)


def test_no_circle_among_rooms():
    assert not circles(modules_of(), rooms=True)


def test_no_function_is_long():
    assert not long_functions()


def test_every_module_has_its_test():
    assert not unmirrored()


# -- the rules themselves, on a tree made up ------------------------------------------------------


@pytest.fixture
def tree(tmp_path):
    """A small tree that keeps every rule, and a function that writes a file of it."""

    def write(place: str, text: str = "") -> Path:
        path = tmp_path / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    for folder in SOURCES:
        write(f"{folder}/a.py")
        write(f"tests/{folder}/test_a.py")
    (tmp_path / "boresight" / "sim").symlink_to("../sim")
    write("sim/room/__init__.py")
    for name in "xy":
        write(f"sim/room/{name}.py")
        write(f"tests/sim/room/test_{name}.py")
    assert not full_folders(tmp_path) and not long_functions(tmp_path) and not unmirrored(tmp_path)
    assert not circles(modules_of(tmp_path), rooms=True)
    return write


def test_a_sixteenth_file_is_told(tree, tmp_path):
    for k in range(13):
        tree(f"sim/room/{k}.txt")
    assert not full_folders(tmp_path)  # nor is the link to it counted
    tree("sim/room/last.txt")
    assert full_folders(tmp_path) == {"sim/room": 16}


@pytest.mark.parametrize(
    "text",
    [
        "import boresight.sim.room.x",
        "from boresight.sim.room import x",
        "from boresight.sim.room.x import name",
        "def later():\n    from boresight.sim.room.x import name",
    ],
)
def test_a_circle_of_modules_is_told(text, tree, tmp_path):
    tree("sim/room/x.py", "from boresight.sim.a import name")
    tree("sim/a.py", "from boresight.sim.room.y import name")
    assert not circles(modules_of(tmp_path), rooms=False)
    tree("sim/room/y.py", text)
    found = [("boresight.sim.a", "boresight.sim.room.x", "boresight.sim.room.y")]
    assert circles(modules_of(tmp_path), rooms=False) == found


def test_a_circle_of_rooms_is_told(tree, tmp_path):
    tree("sim/room/x.py", "from boresight.sim.a import name")
    tree("sim/a.py", "from boresight.sim.room.y import name")
    modules = modules_of(tmp_path)
    assert not circles(modules, rooms=False)
    assert circles(modules, rooms=True) == [("boresight.sim.a", "boresight.sim.room")]


def test_what_lies_beside_a_sub_folder_is_no_one_room(tree, tmp_path):
    tree("sim/b.py", "from boresight.sim.room import x")
    tree("sim/room/x.py", "from boresight.sim import a")
    assert not circles(modules_of(tmp_path), rooms=True)
    tree("sim/room/y.py", "from boresight.sim import b")
    assert circles(modules_of(tmp_path), rooms=True) == [("boresight.sim.b", "boresight.sim.room")]


def test_a_package_is_a_module(tree, tmp_path):
    tree("sim/__init__.py", "from boresight.sim.a import name")
    tree("sim/a.py", "from boresight.sim import other")
    assert circles(modules_of(tmp_path), rooms=False) == [("boresight.sim", "boresight.sim.a")]


def lines(count: int, name: str = "f", doc: int = 0) -> str:
    """A function of so many lines beside its docstring of ``doc`` lines."""
    says = ['    """Doc.', *["    more"] * (doc - 2), '    """'] if doc else []
    return "\n".join([f"def {name}():", *says, *["    x = 1"] * (count - 1)])


def test_a_long_function_is_told(tree, tmp_path):
    tree("sim/a.py", lines(59, doc=30))
    assert not long_functions(tmp_path)
    tree("sim/a.py", lines(60, doc=30))
    assert long_functions(tmp_path) == {"sim/a.py: f": 60}
    tree("sim/a.py", "class C:\n" + indent(lines(60).replace("def", "async def"), "    "))
    assert long_functions(tmp_path) == {"sim/a.py: f": 60}


def test_an_estimators_step_may_be_long(tree, tmp_path):
    tree("model/estimators/a.py", lines(80, "step"))
    assert not long_functions(tmp_path)
    tree("model/estimators/a.py", lines(80, "walk"))
    tree("model/a.py", lines(80, "step"))
    assert long_functions(tmp_path) == {"model/estimators/a.py: walk": 80, "model/a.py: step": 80}


def test_a_module_without_a_test_is_told(tree, tmp_path):
    tree("sim/room/new.py")
    assert unmirrored(tmp_path) == ["sim/room/new.py"]
    tree("tests/sim/test_new.py")
    tree("tests/sim/room/test_newer.py")
    assert unmirrored(tmp_path) == ["sim/room/new.py"]
    tree("tests/sim/room/test_new_parts.py")
    tree("sim/room/__main__.py")
    assert unmirrored(tmp_path) == ["sim/room/__main__.py"]
    tree("tests/sim/room/test_main.py")
    assert not unmirrored(tmp_path)


def test_proofs_are_proven_together(tree, tmp_path):
    tree("sim/formal/blocks/uart.py", "PROOFS = ()")
    tree("sim/formal/blocks/loop.py", "OTHERS = ()")
    both = ["sim/formal/blocks/loop.py", "sim/formal/blocks/uart.py"]
    assert unmirrored(tmp_path) == both
    tree("tests/sim/formal/test_proofs.py")
    assert unmirrored(tmp_path) == both[:1]


def test_the_rules_are_about_this_tree():
    assert (ROOT / "tests" / "test_rooms.py").samefile(__file__)
    assert modules_of()["boresight.sim.rtl.cosim"] == ROOT / "sim" / "rtl" / "cosim.py"
    assert modules_of()["boresight.model"] == ROOT / "model" / "__init__.py"
