"""`boresight convert`: a published data set's files become logs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.arguments import check_choice
from boresight.disk.output import output_folder
from boresight.options import Outcome, progress_of
from boresight.sim.data.convert_broad import broad_record, broad_trials
from boresight.sim.records.files import content_of

__all__ = ["add_arguments", "call", "convert"]

#: Data sets: what finds the files of one in a folder, and what reads one of them.
_DATA_SETS = {"broad": (broad_trials, broad_record)}


def convert(
    data_set: str,
    folder: str | Path,
    *,
    output: str | Path = "build/logs",
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Write an ``.npz`` log for each file of a data set.

    Parameters
    ----------
    data_set : str
        "broad": the ``data_mat`` of https://github.com/dlaidig/broad.
    folder : path
        Where its files are.
    output : path
        Folder of the logs.

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
            rows.append({"log": str(Path(output) / name), "samples": len(record)})
            say(f"[{len(rows)}/{len(paths)}] {name}: {len(record):,} samples")
    return {"data_set": data_set, "logs": rows}


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("data_set", metavar="DATA_SET", help=", ".join(_DATA_SETS))
    parser.add_argument("folder", metavar="FOLDER", help="its files (of BROAD: data_mat)")
    parser.add_argument("-o", "--output", default="build/logs", help="folder of the logs")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = convert(args.data_set, args.folder, output=args.output, progress=progress_of(args))
    count = len(data["logs"])
    return 0, data, f"{count} log{'s' if count > 1 else ''} in {args.output}"
