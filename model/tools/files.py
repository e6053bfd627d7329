"""Output files and the build cache: written completely or not at all.

New files are written in a temporary folder beside their destination and then renamed. The file
``.boresight.json`` in an output folder lists the files that Boresight wrote there, with their
hashes. Any other file, and a listed file that was edited since, is overwritten only with
``--force`` (`overwriting`).

An entry of the build cache holds outputs of compilers, simulators and yosys, by the hash of their
inputs, or a text that takes long (`kept`), by that of its inputs and of Boresight's sources. Its
``entry.json`` lists the hashes of its files; a damaged entry is made again. Beyond a limit, the
least recently used entries are removed, but none that was used within the last hour.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from filelock import FileLock

from boresight.model.errors import InputError, require
from boresight.model.tools.external import cache_folder

#: List of the files that Boresight wrote into a folder.
MANIFEST = ".boresight.json"
#: Suffixes that say that a file was meant, where a folder is written.
_OF_FILES = {".html", ".json", ".v", ".csv"}
#: Size above which entries are removed, in bytes.
_LIMIT = 1_000_000_000
_LIST = "entry.json"
#: Entries used within this time, in seconds, are never removed: a process may be using them.
_RECENT_S = 3600
_trimmed: set[Path] = set()
_PACKAGE = Path(__file__).parents[2]

StrPath = str | os.PathLike[str]
#: By name, relative to the folder: the verb that wrote the file, and the SHA-256 of its contents.
Files = dict[str, dict[str, str]]

_overwriting = ContextVar("overwriting", default=False)


@contextmanager
def overwriting(allowed: bool = True) -> Iterator[None]:
    """Allow output files to replace files that Boresight did not write, or that were edited."""
    token = _overwriting.set(allowed)
    try:
        yield
    finally:
        _overwriting.reset(token)


class OutputFile:
    """A single output file: checked now, written later, once or repeatedly.

    A symbolic link is followed. A device or a pipe, such as ``/dev/stdout``, is written directly;
    missing folders are made. Messages name the ``option`` of the command line. InputError: the path
    cannot be written, is one of the ``inputs``, or holds a file that Boresight did not write.
    """

    def __init__(
        self, path: StrPath, *, inputs: Iterable[StrPath] = (), option: str = "-o"
    ) -> None:
        self._option = option
        self._path = Path(path)
        with _refusing(path, option):
            _require_name(path, option)
            _refuse_inputs(path, inputs, option)
            if not self._direct:
                self._path = Path(os.path.realpath(path))
                known = _listed(self._path.parent)
                _require_ours(self._path, known.get(self._path.name), option)
                _existing_parent(self._path.parent, option)

    @property
    def _direct(self) -> bool:
        other = self._path.exists() and not self._path.is_file() and not self._path.is_dir()
        return other or os.path.abspath(self._path).startswith("/dev/")

    def write(self, content: str | bytes) -> None:
        with self.opened() as file:
            file.write(content.encode("utf-8") if isinstance(content, str) else content)

    @contextmanager
    def opened(self) -> Iterator[BinaryIO]:
        """Open the file for the block; if the block succeeds, it replaces the earlier file."""
        path, option = self._path, self._option
        with ExitStack() as stack:
            with _refusing(path, option):
                staging = None if self._direct else stack.enter_context(_staged(path.parent))
                target: Path | int = path if staging is None else staging / path.name
                if os.fspath(path) == "/dev/stdout":  # Opened anew, it would begin at its start.
                    target = os.dup(1)
                file = stack.enter_context(open(target, "wb"))
            yield file
            file.close()
            if staging is not None:
                with _refusing(path, option):
                    _commit(staging, path.parent, option)


@contextmanager
def output_folder(
    path: StrPath,
    by: str,
    *,
    files: Iterable[str] = (),
    inputs: Iterable[StrPath] = (),
    kept: Callable[[str], object] = str,
) -> Iterator[Path]:
    """Give an empty folder to write into; if the block succeeds, its files move to ``path``.

    Files that an earlier run of the same verb, ``by``, wrote there, and this one did not, are
    removed; ``kept`` is called with the name of each that stays because it was edited. ``files``
    are relative paths that will be written, as far as known: InputError before the work if one
    cannot be, is one of the ``inputs``, or is not of Boresight.
    """
    option = "-o"
    with ExitStack() as stack:
        with _refusing(path, option):
            _require_name(path, option)
            folder = Path(os.path.realpath(path))
            if (suffix := folder.suffix) in _OF_FILES and not folder.exists():
                fix = f"leave {suffix} out"
                raise InputError.at(option, wanted="a folder", found=str(path), fix=fix)
            known = _listed(folder)
            for name in files:
                _refuse_inputs(folder / name, inputs, option)
                _require_ours(folder / name, known.get(name), option)
                _existing_parent((folder / name).parent, option)
            staging = stack.enter_context(_staged(folder))
        yield staging
        with _refusing(path, option):
            for name in _commit(staging, folder, option, by=by):
                kept(name)


def _refuse_inputs(path: StrPath, inputs: Iterable[StrPath], option: str) -> None:
    for source in inputs:
        exist = os.path.isfile(path) and os.path.exists(source)
        wanted, fix = "an output that is not an input", f"choose another with {option}"
        found = f"the same file as the input {os.fspath(source)}"
        require(not exist or not os.path.samefile(path, source), _shown(path), wanted, found, fix)


@contextmanager
def _refusing(path: StrPath, option: str) -> Iterator[None]:
    """Turn errors of the operating system in the block into an InputError for this path."""
    try:
        yield
    except InputError:
        raise
    except (OSError, ValueError) as error:
        text = getattr(error, "strerror", None) or str(error)
        found, wanted = text[:1].lower() + text[1:], "a path that can be written"
        fix = f"choose another with {option}"
        raise InputError.at(_shown(path), wanted=wanted, found=found, fix=fix) from error


def changed_files(folder: Path) -> list[str]:
    """Names of the files of an output folder that are missing, or not as Boresight wrote them."""
    known = _listed(folder)
    if not known or (folder / MANIFEST).read_text(encoding="utf-8") != _manifest(known):
        return [MANIFEST]
    sums = {name: digest(folder / name) for name in known if (folder / name).is_file()}
    return [name for name, file in known.items() if sums.get(name) != file["sha256"]]


def digest(path: Path) -> str:
    """SHA-256 of a file's contents, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _listed(folder: Path) -> Files:
    """The list in a folder; empty if it is missing or damaged."""
    try:
        files = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["files"]
        return {name: {"by": f["by"], "sha256": f["sha256"]} for name, f in files.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _manifest(known: Files) -> str:
    files = dict(sorted(known.items()))
    own = hashlib.sha256(json.dumps(files).encode()).hexdigest()
    return json.dumps({"files": files, "sha256": own}, indent=1) + "\n"


def _require_name(path: StrPath, option: str) -> None:
    fix = f"write a name after {option}; standard output is /dev/stdout"
    name = os.fspath(path).strip()
    require(name not in ("", "-"), option, "the name of a file or folder", name, fix)


def _require_ours(path: Path, known: dict[str, str] | None, option: str) -> None:
    """Refuse to overwrite a folder, or a file that is not as Boresight wrote it."""
    fix = f"move it away, or choose another path with {option}"
    require(not path.is_dir(), _shown(path), "a file", "a folder", fix)
    if _overwriting.get() or not os.path.lexists(path):
        return
    ours = known is not None and path.exists() and digest(path) == known["sha256"]
    found = "a file not written by boresight" if known is None else "an edited file"
    fix = f"move it away, choose another path with {option}, or overwrite it with --force"
    require(ours, _shown(path), "a new file, or an unedited one of boresight", found, fix)


def _existing_parent(folder: Path, option: str = "-o") -> Path:
    """The folder, or its nearest parent that exists; InputError unless files can be made there."""
    while not os.path.lexists(folder):
        folder = folder.parent
    where, fix = _shown(folder), f"choose another path with {option}"
    require(folder.is_dir(), where, "a folder", "a file", fix)
    good, fix = os.access(folder, os.W_OK | os.X_OK), f"{fix}, or change its permissions"
    require(good, where, "a folder that can be written", "one that cannot", fix)
    return folder


@contextmanager
def _staged(folder: Path) -> Iterator[Path]:
    """A temporary folder on the same file system as the output folder."""
    parent = _existing_parent(folder)
    with tempfile.TemporaryDirectory(prefix=".boresight-", dir=parent) as name:
        yield Path(name)


def _commit(staging: Path, folder: Path, option: str, *, by: str = "") -> list[str]:
    """Move the files into the folder, remove stale ones; return those that stay, as edited."""
    names = [p.relative_to(staging).as_posix() for p in staging.rglob("*") if p.is_file()]
    locks = cache_folder("boresight") / "locks"
    locks.mkdir(parents=True, exist_ok=True)
    with FileLock(locks / f"output-{hashlib.sha256(os.fsencode(folder)).hexdigest()[:2]}.lock"):
        known = _listed(folder)
        for name in names:
            _require_ours(folder / name, known.get(name), option)
        stale = [name for name in known if by and known[name]["by"] == by and name not in names]
        kept = []
        for name in stale:
            old, listed = folder / name, known.pop(name)["sha256"]
            if old.is_file() and digest(old) == listed:
                old.unlink()
                with suppress(OSError):  # not empty
                    old.parent.rmdir()
            elif os.path.lexists(old):
                kept.append(name)
        for name in names:
            known[name] = {"by": by, "sha256": digest(staging / name)}
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(staging / name, folder / name)
        (staging / MANIFEST).write_text(_manifest(known), encoding="utf-8")
        os.replace(staging / MANIFEST, folder / MANIFEST)
        return kept


def _shown(path: StrPath) -> str:
    path, here = Path(os.path.abspath(path)), Path.cwd()
    return os.fspath(path.relative_to(here) if path.is_relative_to(here) else path)


class Cache:
    """The build cache in a folder, by default ``boresight/builds`` in the user's cache folder."""

    def __init__(self, root: Path | None = None) -> None:
        self.root = cache_folder("boresight") / "builds" if root is None else Path(root)

    def get(self, name: str, identity: str, make: Callable[[Path], None]) -> Path:
        """Return the folder of the entry with this identity; make the entry if it is absent.

        ``identity`` is everything that the result depends on; the folder's name begins with
        ``name``; ``make`` writes files into an empty folder. If several processes or threads need
        the same entry, one makes it and the others wait. OSError: the cache cannot be written.
        """
        key = hashlib.sha256(identity.encode()).hexdigest()[:32]
        plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:40] or "entry"
        folder = self.root / f"{plain}-{key}"
        if _sound(folder):
            return folder
        (self.root / "locks").mkdir(parents=True, exist_ok=True)
        with FileLock(self.root / "locks" / f"{plain}-{key[:2]}.lock"):
            if _sound(folder):
                return folder
            shutil.rmtree(folder, ignore_errors=True)
            with tempfile.TemporaryDirectory(
                prefix="work-", dir=self.root, ignore_cleanup_errors=True
            ) as work:
                made = Path(work) / "entry"
                made.mkdir()
                make(made)
                files = [p for p in made.rglob("*") if p.is_file()]
                hashes = {p.relative_to(made).as_posix(): digest(p) for p in files}
                (made / _LIST).write_text(json.dumps(hashes), encoding="utf-8")
                made.rename(folder)
        if self.root not in _trimmed:  # Once in a process: it looks at every file.
            _trimmed.add(self.root)
            self.trim()
        return folder

    def usage(self) -> int:
        return sum(size for _, size, _ in self._entries())

    def trim(self) -> None:
        """Remove what killed processes left, and least recently used entries beyond the limit."""
        entries = self._entries()
        left = sum(size for _, size, _ in entries)
        for used, size, folder in sorted(entries):
            if left <= _LIMIT or used > time.time() - _RECENT_S:
                break
            shutil.rmtree(folder, ignore_errors=True)
            left -= size
        for folder in self.root.glob("work-*"):
            if folder.stat().st_mtime < time.time() - 24 * _RECENT_S:
                shutil.rmtree(folder, ignore_errors=True)

    def _entries(self) -> list[tuple[float, int, Path]]:
        """Time of the last use, bytes and folder of each entry."""
        entries = []
        for path in self.root.glob(f"*/{_LIST}"):
            size = sum(p.stat().st_size for p in path.parent.rglob("*") if p.is_file())
            entries.append((path.stat().st_mtime, size, path.parent))
        return entries


class _Edited(Exception):
    """The sources changed after this process imported them; the argument is the text."""


def kept(name: str, identity: str, make: Callable[[], str]) -> str:
    """The text that ``make`` returns, from the build cache if it has been made before.

    The text depends only on ``identity`` and on the sources of this package. Raises OSError as
    `Cache.get` does.
    """

    def write(entry: Path) -> None:
        text = make()
        if _digest_of(_PACKAGE) != package_digest():
            raise _Edited(text)
        (entry / "text").write_bytes(zlib.compress(text.encode(), 1))

    try:
        folder = Cache().get(name, f"{package_digest()} {identity}", write)
    except _Edited as edited:
        return str(edited)
    return zlib.decompress((folder / "text").read_bytes()).decode()


@lru_cache(maxsize=1)
def package_digest() -> str:
    """Hash of all Python files of this package, as they were when this module was imported."""
    return _digest_of(_PACKAGE)


def _digest_of(package: Path) -> str:
    known = hashlib.sha256()
    for folder, folders, files in os.walk(package, followlinks=True):
        folders.sort()
        for file in sorted(file for file in files if file.endswith(".py")):
            with suppress(OSError):  # an editor's lock, or another dangling link
                known.update(f"{file} {digest(Path(folder) / file)}".encode())
    return known.hexdigest()


package_digest()


def _sound(folder: Path) -> bool:
    """Whether an entry exists and its files have their hashes; note that it was used."""
    try:
        hashes = json.loads((folder / _LIST).read_text(encoding="utf-8"))
        if any(digest(folder / name) != value for name, value in hashes.items()):
            return False
        os.utime(folder / _LIST)
    except (OSError, ValueError, AttributeError):
        return False
    return True
