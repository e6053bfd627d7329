"""A published data set's files (BROAD) to logs.

boresight convert broad broad/data_mat -o logs  # needs scipy
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from boresight.arguments import check_choice
from boresight.disk.output import output_folder
from boresight.options import OutputFolder, Verb
from boresight.sim.answer import Answer
from boresight.sim.data.convert_broad import broad_record, broad_trials
from boresight.sim.records.files import content_of

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
    """What `convert` gives: the logs of a data set."""

    data_set: str
    logs: tuple[ConvertedLog, ...]

    def __str__(self) -> str:
        count = len(self.logs)
        return f"{count} log{'s' if count > 1 else ''} in {Path(self.logs[0].log).parent}"


def convert(
    data_set: str,
    folder: str | Path,
    *,
    output: OutputFolder = "build/logs",
    progress: Callable[[str], None] | None = None,
) -> ConvertResult:
    """Write an ``.npz`` log for each file of a data set.

    Parameters
    ----------
    data_set : str
        "broad": the ``data_mat`` of https://github.com/dlaidig/broad.
    folder : path
        Where its files are.
    output : path
        Folder of the logs.

    Returns
    -------
    ConvertResult
        Paths of the logs, and how many samples each has.

    Raises
    ------
    InputError
        Another data set, a folder without its files, a file that is none of its.
    ToolMissing
        scipy, which reads ``.mat``, is not here.
    """
    say = progress or (lambda text: None)
    check_choice("data set", data_set, _DATA_SETS)
    find, read = _DATA_SETS[data_set]
    paths = find(Path(folder))
    names = [f"{path.stem}.npz" for path in paths]
    rows = []
    with output_folder(output, "convert", of=data_set, files=names, inputs=paths) as out:
        for path, name in zip(paths, names, strict=True):
            record = read(path)
            (out / name).write_bytes(content_of(out / name, record))
            rows.append(ConvertedLog(str(Path(output) / name), len(record)))
            say(f"[{len(rows)}/{len(paths)}] {name}: {len(record):,} samples")
    return ConvertResult(data_set, tuple(rows))


VERB = Verb(convert)
