"""Schedule cache: stores results of the scheduler's search, which takes seconds."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import astuple
from pathlib import Path

import boresight.gateware
import boresight.model
from boresight.gateware.machine import Machine
from boresight.gateware.schedule.copies import with_copies
from boresight.gateware.schedule.search import schedule
from boresight.gateware.schedule.slots import Schedule, Slot
from boresight.model.tools.cache import Cache
from boresight.model.words.program import Program

_FILE = "schedule.json"


def digest_of_sources(folders: Iterable[Path]) -> str:
    """SHA-256 of all Python sources below folders: relative names and texts."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            name = path.relative_to(folder).as_posix()
            digest.update(f"{name}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


#: Digest of all sources that the scheduler may import (`tests/test_import_rule.py`).
_SOURCES = digest_of_sources(
    Path(folder) for room in (boresight.model, boresight.gateware) for folder in room.__path__
)


def cached_schedule(
    program: Program, machine: Machine, *, urgent: int | None, state_quota: Sequence[int]
) -> Schedule:
    """Return `gateware.schedule.search.schedule` at default effort, from the cache if possible.

    `gateware.core` proves schedules from the cache as well as new ones.

    Raises
    ------
    ScheduleError
        The program does not fit.
    InputError
        The limit of the build cache is not a number.
    """
    versions = (sys.version, importlib.metadata.version("mpmath"))
    identity = repr((_SOURCES, versions, program.to_json(), machine, urgent, tuple(state_quota)))
    schedules: list[Schedule] = []

    def search(folder: Path) -> None:
        plan = schedule(program, machine, urgent=urgent, state_quota=state_quota)
        schedules.append(plan)
        text = json.dumps([[astuple(slot) for slot in plan.slots], plan.gets, plan.length])
        (folder / _FILE).write_text(text, encoding="utf-8")

    try:
        entry = Cache().get(f"schedule-{program.name}", identity, search)
    except OSError:  # the cache cannot be written: search without it
        return (
            schedules[0]
            if schedules
            else schedule(program, machine, urgent=urgent, state_quota=state_quota)
        )
    if schedules:
        return schedules[0]
    slots, gets, length = json.loads((entry / _FILE).read_text(encoding="utf-8"))
    return Schedule(
        program=with_copies(program),
        source=program.digest,
        machine=machine,
        slots=tuple(Slot(*slot) for slot in slots),
        gets=tuple(gets),
        length=length,
        urgent=len(program.outputs) if urgent is None else urgent,
    )
