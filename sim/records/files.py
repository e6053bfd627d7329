"""Log files by suffix: `FORMATS`, recordings of topics, CSV otherwise; the logs in the package.

`Log` reads a file in blocks, as often as wanted.
"""

from __future__ import annotations

import gzip
import io
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from boresight.model.errors import InputError, ToolMissing, require, require_choice
from boresight.model.tools.reading import opened
from boresight.sim.records.assembly import Reader, record_from
from boresight.sim.records.record import ROWS, Record, joined, resized, timed
from boresight.sim.records.recordings import READY, read_bag, read_map, read_ulog
from boresight.sim.records.selection import Selection, selection
from boresight.sim.records.tables import (
    read_mat,
    read_npz,
    read_parquet,
    records_of,
    write_mat,
    write_npz,
    write_parquet,
)
from boresight.sim.records.text import read_csv, write_csv


class Format(NamedTuple):
    """Reader and writer of the blocks of a log file.

    ``kind`` names it in messages about damage that the library which reads it finds. ``whole``
    tells that reading takes memory for all of it.
    """

    read: Callable[[Path, BinaryIO], Iterator[Record]]
    write: Callable[[BinaryIO, Iterable[Record]], None]
    kind: str = ""
    whole: bool = False


def _packed(file: BinaryIO, mode: str) -> Any:
    """A file packed by gzip: the same bytes at any time."""
    return gzip.GzipFile(filename="", mode=mode, fileobj=file, mtime=0)


def _write_packed(file: BinaryIO, blocks: Iterable[Record]) -> None:
    with _packed(file, "wb") as packed:
        write_csv(packed, blocks)


_CSV = Format(read_csv, write_csv)
#: Formats by the end of the file's name.
FORMATS = {
    ".csv": _CSV,
    ".csv.gz": Format(
        lambda path, file: read_csv(path, _packed(file, "rb")),
        _write_packed,
        "a file packed by gzip",
    ),
    ".npz": Format(
        partial(records_of, read_npz), write_npz, "an .npz archive of plain arrays", True
    ),
    ".parquet": Format(partial(records_of, read_parquet), write_parquet, "a Parquet file"),
    ".mat": Format(partial(records_of, read_mat), write_mat, "a MAT file up to version 7", True),
}
#: Suffixes of CSV that is written. It is read from any other that is not `_FOREIGN`.
_PLAIN = (".txt", ".dat", ".log")
#: Suffixes of other kinds of files, which are not read as CSV.
_FOREIGN = {
    *(".xls", ".xlsx", ".ods", ".h5", ".hdf5", ".feather", ".zst"),
    *(".json", ".npy", ".pkl", ".py"),
}
#: Tables that are no logs: they would be missed in a folder of logs.
_UNREAD = {".zst", ".feather", ".tsv", ".h5", ".hdf5"}
#: Recordings of topics, which are read alone, by the end of the file's name: reader and ready map.
RECORDINGS: dict[str, tuple[Reader, str]] = {
    ".ulg": (read_ulog, "px4"),
    ".bag": (read_bag, "ros"),
    ".db3": (read_bag, "ros"),
    ".mcap": (read_bag, "ros"),
}
#: Largest file that is held in memory, bytes.
_MEMORY_LIMIT = 8 << 20
#: Folder of the bundled logs.
_BUNDLED = Path(__file__).parents[1] / "data"


def read_record(path: str | os.PathLike[str]) -> Record:
    """Read a log file; an InputError names file, line and column (of ``.npz`` array and index)."""
    return joined([*blocks_of(path)])


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """The logs at some paths; a folder stands for every file of `FORMATS` below it."""
    out: list[Path] = []
    for path in map(Path, paths):
        logs = {path}
        if os.path.isdir(path) and not is_bag(path):  # `Path.is_dir` raises on some Pythons
            logs = {p.parent for p in path.rglob("metadata.yaml")}
            files = (p for p in path.rglob("*") if p.name.lower().endswith((*FORMATS, *RECORDINGS)))
            logs |= {p for p in files if p.parent not in logs}
            # In hidden folders are files that are being written, or were when a process was killed.
            hidden = (p for p in logs if any(x[0] == "." for x in p.relative_to(path).parts[:-1]))
            logs = logs - {*hidden}
            unread = [p.name for p in path.rglob("*") if p.suffix.lower() in _UNREAD]
            found, fix = f"{', '.join(unread[:1])} beside them", "convert it, or name each log"
            wanted = f"logs alone ({', '.join(FORMATS)})"
            require(not unread or not logs, str(path), wanted, found, fix)
        wanted = f"a log, or a folder with logs ({', '.join(FORMATS)})"
        require(bool(logs), str(path), wanted, "a folder without any", "name a log file")
        out += sorted(logs)
    return out


def record_of(data: Any, *, name: str = "record") -> Record:
    """Return the record of a log file, if ``data`` is a path, or of data (`Record.of`)."""
    return read_record(data) if isinstance(data, str | Path) else Record.of(data, name=name)


def content_of(path: str | os.PathLike[str], record: Record) -> bytes:
    """Contents of a log file for a record, which `read_record` reads back exactly."""
    buffer = io.BytesIO()
    write_pieces(path, buffer, [record])
    return buffer.getvalue()


def check_written(path: str | os.PathLike[str]) -> None:
    """Refuse the name of a log to be written whose suffix is that of another kind of file."""
    wanted = f"a suffix of logs, {', '.join(FORMATS)}"
    name, suffix = Path(path).name.lower(), Path(path).suffix.lower()
    is_log = suffix in ("", *_PLAIN) or name.endswith(tuple(FORMATS))
    fix = f"choose one; {', '.join(_PLAIN)} and no suffix are CSV"
    require(is_log, str(path), wanted, suffix, fix)


def write_pieces(path: str | os.PathLike[str], file: BinaryIO, pieces: Iterable[Record]) -> None:
    """Write a log file in pieces of any length: the same bytes as of all of it."""
    _format(Path(path)).write(file, resized(map(Record.of_numbers, pieces)))


def read_pieces(path: str | os.PathLike[str], rows: int = ROWS) -> Iterator[Record]:
    """Read a log file in pieces of so many rows, each with its time steps."""
    yield from resized(blocks_of(path, steps=True), rows)


def blocks_of(path: str | os.PathLike[str], *, steps: bool = False) -> Iterator[Record]:
    """A log file in blocks; with time steps where ``steps`` says so, or where rows are selected."""
    blocks, rows = _blocks(Path(path)), selection()
    return rows.pieces(timed(blocks)) if steps or rows != Selection(map=rows.map) else blocks


def is_bag(path: Path) -> bool:
    """Whether a folder is a bag of ROS 2."""
    return os.path.isfile(path / "metadata.yaml")  # `Path.is_file` raises on some Pythons


def recording_of(path: Path) -> tuple[Reader, str] | None:
    """Reader of a recording's topics and name of its ready map; None for a table."""
    if is_bag(path):
        return read_bag, "ros"
    name = path.name.lower()
    return next((pair for suffix, pair in RECORDINGS.items() if name.endswith(suffix)), None)


def _blocks(path: Path) -> Iterator[Record]:
    """A file as it is, in blocks."""
    if (recording := recording_of(path)) is not None:
        read, name = recording
        toml = selection().map
        yield record_from(path, read, READY[name] if toml is None else read_map(toml))
        return
    wanted = f"a recording of topics, for --map: {', '.join(RECORDINGS)}"
    found = "a table, whose columns are inputs"
    require(selection().map is None, str(path), wanted, found, "leave --map out")
    form, suffix, wanted = _format(path), path.suffix.lower(), ", ".join((*FORMATS, *RECORDINGS))
    fix = "export it as one of these"
    require(suffix not in _FOREIGN, str(path), f"a log, {wanted}", suffix, fix)
    with opened(path, "a log file that can be read") as file:
        try:
            yield from form.read(path, file)
        except (InputError, ToolMissing, GeneratorExit):
            raise
        except Exception as error:  # libraries let out whatever they meet in damaged bytes
            if not form.kind:
                raise
            (reason, *_) = (str(error).strip() or type(error).__name__).splitlines()
            found = f"a file that cannot be read as one ({reason[:120]})"
            fix = "write it again, or give it the suffix of what it holds"
            raise InputError.at(str(path), wanted=form.kind, found=found, fix=fix) from None


def _format(path: Path) -> Format:
    name = path.name.lower()
    return next((form for suffix, form in FORMATS.items() if name.endswith(suffix)), _CSV)


@dataclass(frozen=True, eq=False)
class Log:
    """A log: samples, or the file with them, of which no more than a block is held.

    ``name`` is that of its records; ``steps`` the number of leading samples, by default all;
    ``path`` the file that it is from.
    """

    name: str
    data: Record | Path
    steps: int | None = None
    path: Path | None = None

    @classmethod
    def of(
        cls, data: Any, steps: int | None = None, *, name: str = "record", load: bool = False
    ) -> Log:
        """The leading samples of a log file, or of data in memory (`Record.of`).

        A file of more than 8 MB is read again each time, but for ``load``; here its first rows are.
        """
        if isinstance(data, Log):
            return data
        if not isinstance(data, str | Path):
            record = Record.of(data, name=name).head(steps)
            return cls(record.name, record)
        path = Path(data)
        in_blocks = not load and recording_of(path) is None and not _format(path).whole
        if in_blocks and os.path.isfile(path) and os.path.getsize(path) > _MEMORY_LIMIT:
            return cls(next(read_pieces(path)).name, path, steps, path)
        record = read_record(path).head(steps)
        return cls(record.name, record, path=path)

    def named(self, name: str) -> Log:
        """The log with another name."""
        data = self.data if isinstance(self.data, Path) else replace(self.data, name=name)
        return replace(self, name=name, data=data)

    @property
    def comparison(self) -> bool:
        """Its reference is another device's estimate, not truth."""
        return self.first.comparison

    @property
    def first(self) -> Record:
        """All of a log in memory, of a file the first 65,536 rows."""
        return self.data if isinstance(self.data, Record) else next(self.blocks(ROWS))

    def __len__(self) -> int:
        """Count the samples; a file is read for it."""
        return sum(map(len, self.blocks(ROWS)))

    def blocks(self, rows: int) -> Iterator[Record]:
        """The samples in blocks of so many rows, with their time steps; one as it is."""
        if isinstance(self.data, Record):
            fits = len(self.data) <= rows
            yield from [self.data] if fits else resized(timed([self.data]), rows)
            return
        count = 0
        for block in read_pieces(self.data, rows):
            block = replace(block, name=self.name)
            yield block if self.steps is None else block.head(self.steps - count)
            count += len(block)
            if self.steps is not None and count >= self.steps:
                return


def logs_of(logs: Iterable[Any], steps: int | None = None, *, load: bool = False) -> list[Log]:
    """Logs at paths or in folders, and data in memory: ``record``, ``record2``, ...

    Files of one name are named with their folders, as ``FOLDER/NAME``.
    """
    paths = (log_files([x]) if isinstance(x, str | Path) else [x] for x in logs)
    out, unnamed = list[Log](), 0
    for log in chain.from_iterable(paths):
        unnamed += not isinstance(log, Record | Path)
        name = f"record{unnamed if unnamed > 1 else ''}"
        out.append(Log.of(log, steps, name=name, load=load))
    names = [log.name for log in out]
    folders = [() if log.path is None else log.path.absolute().parts[1:-1] for log in out]
    for depth in range(1, 1 + max(map(len, folders), default=0)):
        files = Counter(name for name, _ in {*zip(names, folders, strict=True)})
        names = [
            "/".join((*above[-depth:], log.name)) if files[name] > 1 else name
            for log, name, above in zip(out, names, folders, strict=True)
        ]
    return [log.named(name) for log, name in zip(out, names, strict=True)]


def bundled_names() -> tuple[str, ...]:
    """List the bundled logs: file names without suffix, sorted."""
    return tuple(sorted(path.stem for path in _BUNDLED.glob("*.csv")))


def bundled(name: str) -> Path:
    """Path of one of `bundled_names`, a CSV log; raises `InputError` for other names."""
    require_choice("name of a bundled log", name, bundled_names())
    return _BUNDLED / f"{name}.csv"
