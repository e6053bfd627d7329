"""Compile everything: all that ``boresight compile`` writes, of every estimator, into a folder.

Run as a process of its own by `test_same_bits`, in an environment that the test chooses::

    python compile_all.py FOLDER [--brief] [--off-by-one]
"""

from __future__ import annotations

import argparse
import atexit
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

#: States of one core, of 256: outputs that others read become some, too.
ROOM = 200


def estimators() -> dict[str, type[Any]]:
    """Every estimator by name: the toolkit's and those of `systems/`."""
    from boresight.model.estimator import Estimator
    from boresight.model.resolve import ESTIMATOR_GROUP, offered

    return offered(Estimator, "estimator", ESTIMATOR_GROUP)


def programs(folder: Path, words: Sequence[int]) -> None:
    """Every estimator and every program before the filters; cores have 24 bits where they hold."""
    from boresight.firmware.emit import emit_c
    from boresight.model.attitude.front import FRONT

    for name, kind in {**estimators(), **FRONT}.items():
        for word in words:
            program = kind().compile(word=word)
            place = folder / f"{name}-{word}"
            place.mkdir(parents=True)
            (place / "program.json").write_text(json.dumps(asdict(program), indent=1))
            (place / "digest").write_text(program.digest)
            for file, text in emit_c(program).items():
                (place / file).write_text(text, encoding="utf-8")


def cores(folder: Path, brief: bool) -> None:
    """A complete system of the filters on a board; cores with all other estimators.

    ``brief``: one of the filters, and a small one of the others. The numbers of all are
    in their programs; a core turns them into text, and holds the same tables for any.
    """
    import boresight
    from boresight.model.attitude import FILTERS
    from boresight.model.errors import InputError

    filters = FILTERS[-1:] if brief else FILTERS
    boresight.compile(*filters, board="mimas", output=folder / "system")
    # As many in one core as its states have room.
    parts: list[list[str]] = [[]]
    free = ROOM
    for name, kind in estimators().items():
        if name not in FILTERS:
            free -= len(kind().states)
            if free < 0:
                parts.append([])
                free = ROOM - len(kind().states)
            parts[-1].append(name)
    if brief:
        parts = [["battery"]]
    for number, names in enumerate(parts):
        place = folder / f"others-{number}"
        states = sum(len(estimators()[name]().states) for name in names)
        config = "fast-1024" if states <= ROOM else "fast-2048"
        try:
            boresight.compile(*names, config=config, word=24, output=place)
        except InputError:  # a tolerance finer than 24 bits hold
            boresight.compile(*names, config=config, output=place)


def use_own_cache() -> None:
    """Read nothing from the user's cache, and write nothing into it."""
    from boresight.model.tools.external import cache_folder

    os.environ.setdefault("YOWASP_CACHE_DIR", str(cache_folder("YoWASP")))
    own = tempfile.TemporaryDirectory(prefix="compile-all-")
    atexit.register(own.cleanup)
    os.environ["XDG_CACHE_HOME"] = own.name


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--brief", action="store_true", help="few widths and cores")
    parser.add_argument("--off-by-one", action="store_true", help="and an empty cache")
    args = parser.parse_args()
    if args.off_by_one:
        from off_by_one import disturb

        disturb()
        use_own_cache()
    programs(args.folder / "programs", (32,) if args.brief else (32, 18))
    cores(args.folder, args.brief)
    import boresight

    sys.stdout.write(str(Path(boresight.__file__).parent))


if __name__ == "__main__":
    main()
