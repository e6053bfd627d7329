"""Write a first estimator with its world, a log and a test.

boresight new my_filter  # my_filter.py, my_filter.csv, test_my_filter.py, baseline
boresight new work/my_filter.py  # in another folder
"""

from __future__ import annotations

import importlib.util
import keyword
import os
from importlib import resources
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from boresight.model.errors import InputError
from boresight.model.resolve import ESTIMATOR_GROUP, names_of_entry_points
from boresight.model.tools.files import OutputFile
from boresight.sim.result import Result

#: What is written, by name of the file, and the text that it is made of.
_FILES = {
    "{}.py": "estimator.txt",
    "{}.csv": "log.csv",
    "test_{}.py": "test.txt",
    "{}_baseline.json": "baseline.txt",
}


def new(name: Annotated[str | Path, Parameter(show_default=False)], /) -> Result:
    """Write ``NAME.py`` with an estimator and its world, ``NAME.csv``, and ``test_NAME.py``.

    ``NAME_baseline.json`` has the results of `boresight check`, with which the test compares. The
    test passes as it is. Returns ``files``. Raises InputError for a name that is no module's, or
    that a file of yours has already.

    Parameters
    ----------
    name : str or path
        Name of the module, with or without .py; may begin with a folder.
    """
    path = Path(name)
    stem = path.name.removesuffix(".py")
    _check_name(stem, os.fspath(name))
    words = {"StarterWorld": f"{_class(stem)}World", "Starter": _class(stem), "starter": stem}
    words["STARTER"] = _class(stem).lower()  # the estimator's name
    files = {path.parent / pattern.format(stem): made for pattern, made in _FILES.items()}
    places = [OutputFile(file, option="NAME") for file in files]
    for place, made in zip(places, files.values(), strict=True):
        text = resources.files("boresight.starter").joinpath(made).read_text("utf-8")
        for old, word in words.items():
            text = text.replace(old, word)
        place.write(text)
    source, log, test, baseline = files
    shown = (
        f"{source}: the estimator {_class(stem)}, and {_class(stem)}World that moves it\n"
        f"{log}: a log of that world\n"
        f"{test}: a test of {source.name} on {log.name}\n"
        f"{baseline}: results of check, with which the test compares\n"
        f"now: boresight check {source} {log}\n"
        f"     boresight run {source} {source}\n"
        f"     pytest {test}"
    )
    return Result({"files": [*files]}, summary=shown)


def _class(stem: str) -> str:
    """``my_filter`` as ``MyFilter``."""
    return "".join(part[:1].upper() + part[1:] for part in stem.split("_"))


def _check_name(stem: str, typed: str) -> None:
    """Raise InputError unless a module, and a class, may be called so."""
    here = (Path(typed).parent / f"{stem}.py").resolve()
    objections = {
        "a folder": typed.endswith(os.sep),
        repr(stem): not (stem.isascii() and stem.isidentifier() and _class(stem).isidentifier()),
        "a word of Python": keyword.iskeyword(stem) or keyword.iskeyword(_class(stem)),
        "the name of an estimator that is there": stem in names_of_entry_points(ESTIMATOR_GROUP),
    }
    if not any(objections.values()):
        try:
            spec = importlib.util.find_spec(stem)
            taken = spec is not None and (
                spec.origin is None or Path(spec.origin).resolve() != here
            )
        except ValueError:  # __main__
            taken = True
        objections["the name of an installed module"] = taken
    for objection, holds in objections.items():
        if holds:
            wanted = "a name for a module of your own: letters, digits and _"
            fix = "choose another, such as my_filter"
            raise InputError.at(typed or "''", wanted=wanted, found=objection, fix=fix)
