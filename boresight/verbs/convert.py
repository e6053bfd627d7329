"""A log into another kind of file, or a published data set's files (BROAD) into logs.

boresight convert flight.ulg -o flight.parquet  # a flight log or bag, by the suffix of the output
boresight convert log.csv -o part.csv --from 10s --to 70s  # a slice
boresight convert broad broad/data_mat -o logs  # needs scipy
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from boresight.model.errors import InputError, require_choice
from boresight.model.tools.files import OutputFile, output_folder
from boresight.options import Option, Verb
from boresight.sim.answer import Answer
from boresight.sim.data.convert_broad import broad_record, broad_trials
from boresight.sim.records.files import FORMATS, blocks_of, content_of, write_pieces
from boresight.sim.records.record import Record

__all__ = ["ConvertResult", "ConvertedLog", "convert"]

#: Data sets: what finds the files of one in a folder, and what reads one of them.
_DATA_SETS = {"broad": (broad_trials, broad_record)}


@dataclass(frozen=True)
class ConvertedLog:
    """A log that was written, and its samples."""

    log: str
    samples: int


@dataclass(frozen=True)
class ConvertResult(Answer):
    """What `convert` gives: the logs that were written; ``data_set`` is empty of a log."""

    data_set: str
    logs: tuple[ConvertedLog, ...]

    def __str__(self) -> str:
        count = len(self.logs)
        if not self.data_set:
            return f"{self.logs[0].samples:,} rows to {self.logs[0].log}"
        return f"{count} log{'s' if count > 1 else ''} in {Path(self.logs[0].log).parent}"


def convert(
    source: Annotated[str | Path, Option(metavar="LOG|DATA_SET")],
    folder: Annotated[str | Path | None, Option(metavar="FOLDER")] = None,
    *,
    output: Annotated[str | Path | None, Option(("-o", "--output"), "LOG|DIR")] = None,
    progress: Callable[[str], None] | None = None,
) -> ConvertResult:
    """Write a log as another kind of file, or an ``.npz`` log for each file of a data set.

    Parameters
    ----------
    source : path or str
        A log of any kind, or "broad": the ``data_mat`` of https://github.com/dlaidig/broad.
    folder : path, optional
        Where the files of a data set are.
    output : path, optional
        The log, its kind by the suffix; of a data set the folder of its logs, build/logs by
        default.

    Returns
    -------
    ConvertResult
        Paths of the logs, and how many samples each has.

    Raises
    ------
    InputError
        A bad log or output, another data set, a folder without its files.
    ToolMissing
        What reads or writes the file is not installed.
    """
    say = progress or (lambda text: None)
    if folder is None and str(source) not in _DATA_SETS:
        return _log(Path(source), output, say)
    data_set = str(source)
    require_choice("data set", data_set, _DATA_SETS)
    if folder is None:
        raise InputError.at(
            "convert", wanted=f"the folder of {data_set}", found="none", fix="name it"
        )
    output = output or "build/logs"
    find, read = _DATA_SETS[data_set]
    paths = find(Path(folder))
    names = [f"{path.stem}.npz" for path in paths]
    rows = []
    with output_folder(output, "convert", files=names, inputs=paths) as out:
        for path, name in zip(paths, names, strict=True):
            record = read(path)
            (out / name).write_bytes(content_of(out / name, record))
            rows.append(ConvertedLog(str(Path(output) / name), len(record)))
            say(f"[{len(rows)}/{len(paths)}] {name}: {len(record):,} samples")
    return ConvertResult(data_set, tuple(rows))


def _log(path: Path, output: str | Path | None, say: Callable[[str], None]) -> ConvertResult:
    """A log as another file, block by block."""
    if output is None or not str(output).lower().endswith(tuple(FORMATS)):
        raise InputError.at(
            "-o",
            wanted=f"a file of a suffix that says its kind: {', '.join(FORMATS)}",
            found="none" if output is None else str(output),
            fix="name it",
        )
    count, notes = 0, dict[str, None]()

    def counted() -> Iterator[Record]:
        nonlocal count
        for block in blocks_of(path):
            count += len(block)
            notes.update(dict.fromkeys(block.notes))
            yield block

    with OutputFile(output, inputs=[path]).opened() as file:
        write_pieces(output, file, counted())
    for text in notes:
        say(f"warning: {text}")
    return ConvertResult("", (ConvertedLog(str(output), count),))


VERB = Verb(convert)
