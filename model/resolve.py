"""Names as users write them: ``mekf``, ``vqf(rate_hz=256)``, ``file.py:Class(sites=2)``.

A name stands for an entry point of an installed package. The class name may be
left out if the file holds one class. Classes and objects stand for themselves.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import math
import os
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias, TypeVar

from boresight.model.declarations import ATTITUDE, ATTITUDE_DEG, QUATERNION, Output
from boresight.model.errors import InputError, listed, require
from boresight.model.estimator import Estimator
from boresight.model.lowering.profile import Profile, read_profile
from boresight.model.settings import CURRENT
from boresight.model.units import conversion

#: Entry points of installed packages that are estimators.
ESTIMATOR_GROUP = "boresight.estimators"

#: An estimator as an argument: a text, a class or an object.
Named: TypeAlias = str | type[Estimator] | Estimator

#: A tolerance in `model.settings`: name, number, unit.
_TOLERANCE = re.compile(r"\s*(\w+)\s*=\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")

T = TypeVar("T")


def profile_place(source: Named, name: str) -> Path | None:
    """File of the profile of an estimator in a file of its own; None for any other estimator.

    ``track.fit.json`` beside ``track.py``, or ``track.NAME.fit.json`` if the estimator has another
    name than its file.
    """
    path, _ = _parts(source) if isinstance(source, str) else ("", None)
    if not path:
        return None
    file = Path(path)
    middle = "" if file.stem == name else f".{name}"
    return file.with_name(f"{file.stem}{middle}.fit.json")


def _profile(source: Named, estimator: Estimator) -> Profile | None:
    files = CURRENT.get().profiles
    if files is None:
        place = profile_place(source, estimator.name)
        return read_profile(place) if place is not None and place.exists() else None
    profiles = [read_profile(file) for file in files]
    matching = [profile for profile in profiles if profile.estimator == estimator.name]
    if profiles and not matching:
        wanted, fix = f"a profile of {estimator.name}", "add one of it, or leave --profile out"
        require(False, profiles[0].place, wanted, profiles[0].estimator, fix)
    return matching[-1] if matching else None


def _judged(estimator: str, outputs: tuple[Output, ...]) -> tuple[Output, ...]:
    """The outputs of an estimator, with the tolerances of `model.settings`."""
    judged = {o.name: o for o in outputs}
    for text in CURRENT.get().tolerances:
        match, where = _TOLERANCE.fullmatch(text), "--tolerance"
        name, number, unit = match.groups() if match else ("", "nan", "")
        limit = float(number)
        fix = f"write for example --tolerance {outputs[0].name}=0.05{outputs[0].unit}"
        wanted = "OUTPUT=NUMBER, 0 or more, with or without a unit"
        require(math.isfinite(limit), where, wanted, text, fix)
        rotates = judged.keys() >= {*QUATERNION}
        names, attitude = [*judged, *[ATTITUDE] * rotates], rotates and name == ATTITUDE
        fix = "choose one of its outputs; estimators with others are judged one by one"
        wanted = f"an output of {estimator}: {listed(name, names)}"
        require(name in names, where, wanted, name, fix)
        output_unit = "deg" if attitude else judged[name].unit
        factor, _ = conversion(f"{where} {text}", name, unit, output_unit) if unit else (1.0, 0.0)
        limit *= factor / (ATTITUDE_DEG if attitude else 1.0)
        for changed in QUATERNION if attitude else (name,):
            judged[changed] = replace(judged[changed], tolerance=limit)
    return tuple(judged.values())


def estimator_of(source: Named) -> Estimator:
    """Return the estimator that a name, class or object stands for, with checked declarations.

    Texts have the form given at the head of this module. The profile and the tolerances of
    `model.settings` are attached. InputError: an unknown name; a file that does not exist, does not
    import, or holds no estimator or several; arguments that the constructor does not take;
    declarations that contradict each other; a file of profiles that holds no profile, or none of
    this estimator; a tolerance that does not fit.
    """
    estimator = load(source, Estimator, "estimator", ESTIMATOR_GROUP)
    estimator.check_declarations()
    if not isinstance(source, Estimator):
        estimator.profile = _profile(source, estimator)
        estimator.outputs = _judged(estimator.name, estimator.outputs)
    return estimator


def split_names(text: str) -> list[str]:
    """Split a text at commas outside brackets."""
    out, depth, start = list[str](), 0, 0
    for k, c in enumerate(text):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            out.append(text[start:k])
            start = k + 1
    return [*out, text[start:]]


def names_of_entry_points(group: str) -> list[str]:
    return sorted({point.name for point in _entry_points(group)})


@lru_cache(maxsize=8)
def _entry_points(group: str) -> metadata.EntryPoints:
    return metadata.entry_points(group=group)  # reads the metadata of everything installed


def offered(base: type[T], kind: str, group: str) -> dict[str, type[T]]:
    """Return the classes of a group of entry points by name, those that can be imported."""
    classes: dict[str, type[T]] = {}
    for name in names_of_entry_points(group):
        with suppress(InputError):
            classes[name] = _lookup(name, base, kind, group)
    return classes


def load(source: Any, base: type[T], kind: str, group: str) -> T:
    """Return an object of class ``base``, as `estimator_of` does.

    ``kind`` is "estimator" or "world", for messages; ``group`` that of the entry points.
    """
    if isinstance(source, base):
        return source
    if isinstance(source, type) and issubclass(source, base):
        return _constructed(source, source.__name__, (), {})
    wanted = f"a name, file.py:Class, a class or an object of {base.__name__}"
    fix = f"derive the class from boresight.{base.__name__}"
    require(isinstance(source, str), kind, wanted, type(source).__name__, fix)
    path, call = _parts(source)
    if not path:
        name, args, options = call_of(source, source) if source.endswith(")") else (source, (), {})
        return _constructed(_lookup(name, base, kind, group), source, args, options)
    module = _module(Path(path), kind)
    name, args, options = ("", (), {}) if call is None else call_of(call, source)
    return _constructed(_class(module, name, base, kind, path), source, args, options)


def _parts(source: str) -> tuple[str, str | None]:
    """Path of the file in ``file.py:Class``, and the class if there is one; no path of a name."""
    stem, colon, call = source.partition(".py:")
    if colon:
        return f"{stem}.py", call
    return (source if source.endswith(".py") else ""), None


def _lookup(name: str, base: type[T], kind: str, group: str) -> type[T]:
    if name not in names_of_entry_points(group):
        _entry_points.cache_clear()  # perhaps installed meanwhile
    for point in _entry_points(group):
        if point.name == name:
            return _loaded(point, base, f"{kind} {name}")
    fix = "boresight info shows them all"
    if os.path.isfile(f"{name}.py"):
        fix = f"write {name}.py, the file that is here"
    elif os.path.exists(name):
        fix = f"the {kind} comes first, logs after it"
    wanted = f"file.py:Class, or one of {listed(name, names_of_entry_points(group))}"
    raise InputError.at(kind, wanted=wanted, found=repr(name), fix=fix)


def _loaded(point: metadata.EntryPoint, base: type[T], where: str) -> type[T]:
    wanted = f"an entry point of a class derived from boresight.{base.__name__} ({point.value})"
    cause = None
    try:
        loaded = point.load()
        if isinstance(loaded, type) and issubclass(loaded, base):
            return loaded
        found = (loaded if isinstance(loaded, type) else type(loaded)).__name__
    except Exception as error:
        wanted, cause = f"an importable entry point ({point.value})", error
        found = f"{type(error).__name__}: {error}"
    fix = "correct or remove the package that registers it"
    raise InputError.at(where, wanted=wanted, found=found, fix=fix) from cause


#: Modules that users' files imported from their own folder, and that folder with its content.
_helpers: set[str] = set()
_folder: bytes = b""
#: Users' folders that have been put on the path.
_on_path: list[str] = []


def _module(path: Path, kind: str) -> ModuleType:
    """Import a file; once, until it or a module or package in its folder changes."""
    global _folder
    try:
        content = path.read_bytes()
    except OSError as error:
        wanted, text = f"a Python file with {_noun(kind)}", error.strerror or type(error).__name__
        fix = "check the path"
        raise InputError.at(str(path), wanted=wanted, found=text.lower(), fix=fix) from None
    file = path.resolve()
    packages = [init.parent for init in file.parent.glob("*/__init__.py")]
    found = (*file.parent.glob("*.py"), *(f for place in packages for f in place.rglob("*.py")))
    modules = sorted(f for f in found if f.is_file() and os.access(f, os.R_OK))
    folder = b"".join(str(f).encode() + hashlib.sha256(f.read_bytes()).digest() for f in modules)
    digest = hashlib.sha256(str(file).encode() + content + folder)
    name = f"_boresight_{digest.hexdigest()[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    if folder != _folder:  # helpers of another folder, or of another state of it
        while _helpers:
            sys.modules.pop(_helpers.pop(), None)
        _folder = folder
    with _imports_from(file.parent):
        spec = importlib.util.spec_from_file_location(name, file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            # No .pyc: two texts of the same second and length would share it.
            exec(compile(content, file, "exec", dont_inherit=True), module.__dict__)
        except (Exception, SystemExit) as error:
            del sys.modules[name]
            if isinstance(error, InputError):
                raise
            line, text = _error_line(error, file, path), _error_text(error)
            of_kalman = re.search(r"State\.__init__\(\) .* '(sd|sd_max)'$", text)
            fix = "import State from boresight.kalman" if of_kalman else "correct it"
            raise InputError.at(line, wanted="an importable file", found=text, fix=fix) from error
    return module


@contextmanager
def _imports_from(folder: Path) -> Iterator[None]:
    """Let imports find the modules in a user's folder, without .pyc files."""
    writes_no_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    before = {*sys.modules}
    entries = [entry for entry in sys.path if entry not in _on_path]
    if str(folder) not in (*entries, *_on_path):
        _on_path.append(str(folder))
    sys.path[:] = [str(folder), *entries]  # not the folders of other files
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.dont_write_bytecode = writes_no_bytecode
        path = [entry for entry in (*entries, *_on_path) if entry != str(folder)]
        sys.path[:] = [*path, str(folder)]  # for imports inside functions
        for name in {*sys.modules} - before:
            file = Path(getattr(sys.modules[name], "__file__", None) or "")
            own = file.parent == folder
            if folder in file.parents and not own:  # in a package
                own = (folder / file.relative_to(folder).parts[0] / "__init__.py").exists()
            if own and not name.startswith("_boresight_"):
                _helpers.add(name)


def _error_text(error: BaseException) -> str:
    """Python's message; of a name that is missing in a module, without the module's path."""
    text = f"{type(error).__name__}: {error}".splitlines()[0][:200]
    return re.sub(r" \(\S*\.py\)$", "", text) if isinstance(error, ImportError) else text


def _error_line(error: BaseException, file: Path, path: Path) -> str:
    """Path of a user's file, with the line of the error if it is in that file."""
    if isinstance(error, SyntaxError) and error.filename == str(file) and error.lineno:
        return f"{path}, line {error.lineno}"
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
    return f"{path}, line {lines[-1]}" if lines else str(path)


def call_of(text: str, source: str) -> tuple[str, tuple[Any, ...], dict[str, Any]]:
    """``Class`` or ``Class(1, n=2)`` as name and literal arguments."""
    try:
        node = ast.parse(text, mode="eval").body
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            options = {str(k.arg): ast.literal_eval(k.value) for k in node.keywords if k.arg}
            if len(options) == len(node.keywords):
                return node.func.id, tuple(map(ast.literal_eval, node.args)), options
        elif isinstance(node, ast.Name):
            return node.id, (), {}
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        pass
    wanted = "file.py:Class or file.py:Class(NAME=VALUE)"
    fix = "give numbers and texts as arguments, in quotes for the shell"
    raise InputError.at(repr(source), wanted=wanted, found=repr(text), fix=fix)


def _class(module: ModuleType, name: str, base: type[T], kind: str, path: str) -> type[T]:
    derived = {n: c for n, c in vars(module).items() if isinstance(c, type) and issubclass(c, base)}
    if name in derived:
        return derived[name]
    classes = {n: c for n, c in derived.items() if c.__module__ == module.__name__}
    if not name and len(set(classes.values())) == 1:
        return next(iter(classes.values()))
    found = ", ".join(classes) or (f"no {name}" if name else "none")
    if name and name in vars(module):
        found = f"{name}, not derived from {base.__name__}"
    wanted = f"{f'a class {name}' if name else 'one class'} derived from boresight.{base.__name__}"
    fix = f"name one: {path}:{next(iter(classes))}" if classes else f"write {_noun(kind)} in it"
    raise InputError.at(path, wanted=wanted, found=found, fix=fix)


def _noun(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeio' else 'a'} {kind}"


def _constructed(cls: type[T], source: str, args: tuple[Any, ...], options: dict[str, Any]) -> T:
    try:
        inspect.signature(cls).bind(*args, **options)
    except TypeError as error:
        wanted, found = f"arguments that {cls.__name__} takes", f"TypeError: {error}"
        fix = f"write {cls.__name__}(NAME=VALUE, ...)"
        raise InputError.at(source, wanted=wanted, found=found, fix=fix) from error
    try:
        return cls(*args, **options)
    except InputError:
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        file = Path(last.filename).name
        where = f"{source if source == file else f'{source}, {file}'}, line {last.lineno}"
        wanted, fix = "a constructor without an error", "correct it, or the arguments"
        raise InputError.at(where, wanted=wanted, found=_error_text(error), fix=fix) from error
