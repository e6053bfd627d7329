"""The shape of the tree: no circles among modules or rooms."""

from pathlib import Path

import pytest

from tests.support.tree import ROOT, SOURCES, circles, modules_of


def test_no_circle_among_modules():
    assert not circles(modules_of(), rooms=False)


def test_no_circle_among_rooms():
    assert not circles(modules_of(), rooms=True)


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
    write("tests/sim/room/test_both.py")
    assert not circles(modules_of(tmp_path), rooms=True)
    return write


@pytest.mark.parametrize(
    "text",
    [
        "import boresight.sim.room.x",
        "from boresight.sim.room import x",
        "from boresight.sim.room.x import name",
        "def later():\n    from boresight.sim.room.x import name",
    ],
)
def test_a_circle_of_modules_is_named(text, tree, tmp_path):
    tree("sim/room/x.py", "from boresight.sim.a import name")
    tree("sim/a.py", "from boresight.sim.room.y import name")
    assert not circles(modules_of(tmp_path), rooms=False)
    tree("sim/room/y.py", text)
    results = [("boresight.sim.a", "boresight.sim.room.x", "boresight.sim.room.y")]
    assert circles(modules_of(tmp_path), rooms=False) == results


def test_a_circle_of_rooms_is_named(tree, tmp_path):
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


def test_the_rules_are_about_this_tree():
    assert (ROOT / "tests" / "test_rooms.py").samefile(__file__)
    assert modules_of()["boresight.sim.rtl.cosim"] == ROOT / "sim" / "rtl" / "cosim.py"
    assert modules_of()["boresight.model"] == ROOT / "model" / "__init__.py"
