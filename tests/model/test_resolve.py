"""From texts, classes and objects to estimators; what is refused, in one line."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from boresight.model import resolve
from boresight.model.attitude.mekf import Mekf
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Output
from boresight.model.resolve import estimator_of, load, names_of_entry_points, split_names
from boresight.sim.worlds.world import World

pytestmark = pytest.mark.pythons

HEAD = "from boresight import Estimator, Output, World\n\n\n"
ONE = HEAD + (
    "class Mine(Estimator):\n"
    "    outputs = (Output('y'),)\n\n"
    "    def __init__(self, n=1, name='mine', more=None):\n"
    "        if n < 0:\n"
    "            raise ValueError('n is negative\\nand more')\n"
    "        self.n, self.name, self.more = n, name, more\n"
)
TWO = ONE + "\n\nclass Other(Mine):\n    pass\n"

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a file and gives its relative path; nothing of it stays in the interpreter."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = set(sys.modules)

    def written(text: str, name: str = "f.py") -> str:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
        return name

    yield written
    for name in set(sys.modules) - before:
        del sys.modules[name]


def refused(what: Any) -> str:
    with pytest.raises(InputError) as raised:
        estimator_of(what)
    return str(raised.value)


def test_names_classes_and_objects() -> None:
    assert type(estimator_of("mekf")) is Mekf
    assert type(estimator_of(Mekf)) is Mekf
    made = Mekf()
    assert estimator_of(made) is made


@pytest.mark.parametrize(
    "call, n, name, more",
    [
        ("", 1, "mine", None),
        (":Mine", 1, "mine", None),
        (":Mine()", 1, "mine", None),
        (":Mine(2)", 2, "mine", None),
        (":Mine(n=3, name='theirs')", 3, "theirs", None),
        (":Mine(name='x', more={'a:b': [1, -2.5]})", 1, "x", {"a:b": [1, -2.5]}),
        (":Mine(more='g.py:Class')", 1, "mine", "g.py:Class"),
    ],
)
def test_calls(write: Write, call: str, n: int, name: str, more: Any) -> None:
    made: Any = estimator_of(write(ONE) + call)
    assert (type(made).__name__, made.n, made.name, made.more) == ("Mine", n, name, more)


def test_one_of_several(write: Write) -> None:
    path = write(TWO)
    assert type(estimator_of(f"{path}:Other")).__name__ == "Other"
    assert refused(path) == (
        "f.py: wanted one class derived from boresight.Estimator, found Mine, Other; "
        "name one: f.py:Mine"
    )
    aliased = write(ONE + "\n\nAgain = Mine\n", "g.py")
    assert type(estimator_of(aliased)).__name__ == "Mine"


def test_modules_beside_the_file_and_classes_of_theirs(write: Write) -> None:
    write(ONE, "lib_of_mine.py")
    path = write("from lib_of_mine import Mine\n")
    assert type(estimator_of(f"{path}:Mine")).__module__ == "lib_of_mine"
    # Unless it is named, what a file imports is not what it holds.
    assert refused(path) == (
        "f.py: wanted one class derived from boresight.Estimator, found none; "
        "write an estimator in it"
    )


HELPED = "from boresight import Estimator, Output\nfrom helper import NAME\n\n\n" + (
    "class Mine(Estimator):\n    outputs = (Output('y'),)\n    name = NAME\n"
)


def test_folders_with_a_helper_of_one_name(write: Write) -> None:
    for folder in "ab":
        write(f"NAME = 'of_{folder}'\n", f"{folder}/helper.py")
        write(HELPED, f"{folder}/f.py")
    first = estimator_of("a/f.py")
    assert [first.name, estimator_of("b/f.py").name] == ["of_a", "of_b"]
    assert type(estimator_of("a/f.py")) is type(first)  # also when another folder came between


def test_a_helper_that_changes_is_read_again(write: Write) -> None:
    write("NAME = 'one'\n", "helper.py")
    assert estimator_of(write(HELPED)).name == "one"
    write("NAME = 'two'\n", "helper.py")
    assert estimator_of("f.py").name == "two"


def test_a_helper_in_a_package_that_changes_is_read_again(write: Write) -> None:
    write("from .inner import NAME\n", "helper/__init__.py")
    write("NAME = 'one'\n", "helper/inner.py")
    assert estimator_of(write(HELPED)).name == "one"
    write("NAME = 'two'\n", "helper/inner.py")
    assert estimator_of("f.py").name == "two"


def test_a_helper_is_not_taken_from_the_folder_of_another_file(write: Write) -> None:
    write("NAME = 'other'\n", "a/helper.py")
    assert estimator_of(write(HELPED, "a/f.py")).name == "other"
    assert "No module named 'helper'" in refused(write(HELPED, "b/f.py"))


def test_a_line_of_a_file_whose_name_has_a_space_is_told_once(write: Write) -> None:
    step = "    inputs = (Input('z', 0.0, 1.0),)\n\n    def step(self, x, u, p):\n        u.y\n"
    made = estimator_of(write(ONE.replace("Output, ", "Output, Input, ") + step, "my f.py"))
    with pytest.raises(InputError, match=r"^my f\.py, line \d+: wanted one of the declared inputs"):
        made.compile()


def test_a_file_is_imported_once_for_each_content(write: Write) -> None:
    first = estimator_of(write(ONE))
    assert type(estimator_of("f.py:Mine(2)")) is type(first)
    write(ONE.replace("n=1", "n=7"))
    again: Any = estimator_of("f.py")
    assert type(again) is not type(first) and again.n == 7
    write(ONE, "sub/f.py")
    assert type(estimator_of("sub/f.py")) is not type(first)  # another place is another file


@pytest.mark.pythons
@pytest.mark.parametrize(
    "text, call, message",
    [
        (ONE, ":Nine", "f.py: wanted a class Nine derived from boresight.Estimator, found Mine; "
         "name one: f.py:Mine"),
        (HEAD, ":Nine", "f.py: wanted a class Nine derived from boresight.Estimator, found no "
         "Nine; write an estimator in it"),
        (HEAD, "", "f.py: wanted one class derived from boresight.Estimator, found none; write an"),
        (ONE + "k = 5\n", ":k", "f.py: wanted a class k derived from boresight.Estimator, found k, "
         "not derived from Estimator; name one: f.py:Mine"),
        (HEAD, ":World", "f.py: wanted a class World derived from boresight.Estimator, found "
         "World, not derived from Estimator; write an estimator in it"),
        (ONE, ":", "'f.py:': wanted file.py:Class or file.py:Class(NAME=VALUE), found ''; give "),
        (ONE, ":Mine(n=x)", "'f.py:Mine(n=x)': wanted file.py:Class or file.py:Class(NAME=VALUE), "
         "found 'Mine(n=x)'; give numbers and texts as arguments, in quotes for the shell"),
        (ONE, ":Mine(**{'n': 1})", '"f.py:Mine(**{\'n\': 1})": wanted file.py:Class or '),
        (ONE, ":Mine(*[1])", "'f.py:Mine(*[1])': wanted file.py:Class or file.py:Class(NAME=VALUE"),
        (ONE, ":Mine(", "'f.py:Mine(': wanted file.py:Class or file.py:Class(NAME=VALUE), found "),
        (ONE, ":os.path(1)", "'f.py:os.path(1)': wanted file.py:Class or file.py:Class(NAME=VALUE"),
        (ONE, ":Mine(k=1)", "f.py:Mine(k=1): wanted arguments that Mine takes, found TypeError: "),
        (ONE, ":Mine(-1)", "f.py:Mine(-1), f.py, line 9: wanted a constructor without an error, "
         "found ValueError: n is negative; correct it, or the arguments"),
        (ONE.replace("n=1", "n=-1"), "", "f.py, line 9: wanted a constructor without an error, "),
        (ONE, ":Mine(name='a b')", "f.py, line 4, estimator a b: wanted estimator names of "),
        ("x = (\n", "", "f.py, line 1: wanted an importable file, found SyntaxError: "),
        ("import os\n\n1 / 0\n", "", "f.py, line 3: wanted an importable file, found "
         "ZeroDivisionError: "),
        ("import no_such_thing\n", "", "f.py, line 1: wanted an importable file, found "
         "ModuleNotFoundError: "),
        ("raise SystemExit(3)\n", "", "f.py, line 1: wanted an importable file, "),
        ("def f():\n    import json\n    json.loads('')\n\n\nf()\n", "", "f.py, line 3: wanted an "
         "importable file, found JSONDecodeError: "),
        (HEAD + "Output('y', tolerance=-1)\n", "", "f.py, line 4, output y: wanted a tolerance "),
        (HEAD + "class Empty(Estimator):\n    pass\n", "", "f.py, line 4, estimator empty: "),
    ],
)  # fmt: skip
def test_files_that_are_refused(write: Write, text: str, call: str, message: str) -> None:
    result = refused(write(text) + call)
    assert result.startswith(message) and "\n" not in result


def test_a_fault_in_a_module_beside_the_file_is_not_put_on_the_files_line(write: Write) -> None:
    write("\n\n\n\nx = (\n", "broken_of_mine.py")
    result = refused(write("import os\nimport broken_of_mine\n"))
    assert result.startswith("f.py, line 2: wanted an importable file, found SyntaxError: ")
    assert result.endswith(" (broken_of_mine.py, line 5); correct it")


def test_a_file_that_failed_is_tried_again(write: Write) -> None:
    flag = Path("ready")
    path = write(f"import pathlib\nassert pathlib.Path({str(flag)!r}).exists()\n{ONE}")
    assert refused(path).startswith("f.py, line 2: wanted an importable file, found AssertionErr")
    flag.touch()
    assert estimator_of(path).name == "mine"


def test_no_file(tmp_path: Path) -> None:
    assert refused(f"{tmp_path}/x.py") == (
        f"{tmp_path}/x.py: wanted a Python file with an estimator, found no such file or "
        "directory; check the path"
    )
    (tmp_path / "d.py").mkdir()
    assert "found is a directory; " in refused(f"{tmp_path}/d.py")


@pytest.mark.parametrize("what, reason", [(5, "int"), (None, "NoneType"), (World, "type")])
def test_what_is_no_estimator(what: Any, reason: str) -> None:
    assert refused(what) == (
        "estimator: wanted a name, file.py:Class, a class or an object of Estimator, found "
        f"{reason!r}; derive the class from boresight.Estimator"
    )


def test_objects_are_checked() -> None:
    made = Mekf()
    made.urgent = 99
    result = refused(made)
    assert re.match(r"mekf\.py, line \d+, estimator mekf: wanted urgent of 0 to ", result)


class Offered(Estimator):
    """What a package offers."""

    outputs = (Output("y"),)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Entry points of packages that are not there."""

    class Point:
        def __init__(self, name: str, value: Any) -> None:
            self.name, self.value, self._loads = name, f"package:{name}", value

        def load(self) -> Any:
            if isinstance(self._loads, Exception):
                raise self._loads
            return self._loads

    calls = []

    @cache
    def points(group: str) -> list[Point]:
        assert group == "boresight.estimators"
        calls.append(group)
        return [
            *[Point("later", Offered)] * (len(calls) > 1),
            Point("theirs", Offered),
            Point("broken", ImportError("no numpy")),
            Point("number", 5),
            Point("world", World),
            Point("mekf", Offered),
        ]

    monkeypatch.setattr(resolve, "_entry_points", points)


def test_entry_points(installed: None) -> None:
    assert type(estimator_of("theirs")) is Offered
    assert names_of_entry_points("boresight.estimators") == [
        "broken", "mekf", "number", "theirs", "world"
    ]  # fmt: skip
    assert refused("broken") == (
        "estimator broken: wanted an importable entry point (package:broken), found "
        "ImportError: no numpy; correct or remove the package that registers it"
    )
    for name, entry in (("number", "int"), ("world", "World")):
        assert refused(name) == (
            f"estimator {name}: wanted an entry point of a class derived from boresight.Estimator "
            f"(package:{name}), found {entry}; correct or remove the package that registers it"
        )


def test_what_is_installed_meanwhile_is_found(installed: None) -> None:
    assert "later" not in names_of_entry_points("boresight.estimators")
    assert type(estimator_of("later")) is Offered


def test_unknown_names_are_answered_with_the_nearest(installed: None) -> None:
    with pytest.raises(InputError) as raised:
        load("three", Estimator, "estimator", resolve.ESTIMATOR_GROUP)
    assert str(raised.value) == (
        "estimator: wanted file.py:Class, or one of broken, later, mekf, number, theirs, "
        "world, found 'three'; boresight info shows them all"
    )


def test_worlds(write: Write) -> None:
    path = write(HEAD + "class Plant(World):\n    pass\n")
    assert load(path, World, "world", "boresight.worlds").name == "plant"
    with pytest.raises(InputError, match="wanted a Python file with a world, found no such file"):
        load("none.py", World, "world", "boresight.worlds")
    write(HEAD, "g.py")
    with pytest.raises(InputError, match="found none; write a world in it$"):
        load("g.py", World, "world", "boresight.worlds")


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("a,b", ["a", "b"]),
        ("f.py:C(1, n=[2,3]),b", ["f.py:C(1, n=[2,3])", "b"]),
        ("f.py:C({1:2,3:4}),g.py:D((1,2))", ["f.py:C({1:2,3:4})", "g.py:D((1,2))"]),
        ("a,", ["a", ""]),
    ],
)
def test_split_names(text: str, wanted: list[str]) -> None:
    assert split_names(text) == wanted
