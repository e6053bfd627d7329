"""A schedule is searched for once, and anew when anything that decides it changes."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from boresight.gateware import schedule_cache
from boresight.gateware.core import build_core
from boresight.gateware.machine import CONFIGS, Machine
from boresight.gateware.schedule.scheduler import schedule
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.gateware.schedule_cache import cached_schedule, digest_of_sources
from boresight.model.tools import cache
from boresight.model.words.program import Kind, Program
from tests.support.random_program import random_program

SMALL = CONFIGS["small"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty build cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "boresight"


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Machines of the searches that took place; each is a short one."""
    done: list[str] = []

    def search(program: Program, machine: Machine, **options: object) -> Schedule:
        done.append(machine.name)
        return schedule(program, machine, restarts=2, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(schedule_cache, "schedule", search)
    return done


def kept(program: Program, machine: Machine = SMALL, **options) -> Schedule:
    return cached_schedule(program, machine, **{"urgent": None, "state_quota": (9, 9), **options})


@pytest.mark.parametrize("config", ["small", "fast"])
@pytest.mark.parametrize("seed", range(4))
def test_what_is_kept_is_what_was_found(config: str, seed: int, searches: list[str]) -> None:
    program, machine = random_program(seed), CONFIGS[config]
    first, again = kept(program, machine), kept(program, machine)
    assert searches == [config]
    assert again is not first and again == first and again.to_json() == first.to_json()
    assert first.program.to_json() == again.program.to_json()


def other_start(program: Program) -> Program:
    """Another initial value, which no schedule shows."""
    number = next(n for n, v in enumerate(program.values) if v.kind is Kind.STATE)
    values = list(program.values)
    values[number] = dataclasses.replace(values[number], initial=values[number].initial ^ 1)
    return dataclasses.replace(program, values=tuple(values))


@pytest.mark.parametrize(
    "change",
    [
        lambda p: kept(other_start(p)),
        lambda p: kept(p, CONFIGS["fast"]),
        lambda p: kept(p, dataclasses.replace(SMALL, rom_words=2048)),
        lambda p: kept(p, urgent=1),
        lambda p: kept(p, state_quota=(8, 9)),
    ],
)
def test_whatever_decides_it_is_in_the_key(
    change: Callable[[Program], Schedule], searches: list[str]
) -> None:
    program = random_program(1)
    kept(program)
    change(program)
    assert len(searches) == 2
    kept(program)
    assert len(searches) == 2


@pytest.mark.parametrize(
    "name, value",
    [("_SOURCES", "other"), ("sys.version", "4.0"), ("importlib.metadata.version", str)],
)
def test_another_version_of_what_decides_it_searches_anew(
    name: str, value: object, searches: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(random_program(1))
    monkeypatch.setattr(f"boresight.gateware.schedule_cache.{name}", value)
    kept(random_program(1))
    assert len(searches) == 2


def test_a_changed_source_changes_the_digest(tmp_path: Path) -> None:
    room = tmp_path / "room"
    (room / "inner").mkdir(parents=True)
    (room / "a.py").write_text("a")
    (room / "inner" / "b.py").write_text("b")
    (room / "notes.txt").write_text("no source")
    seen = [digest_of_sources([room])]
    for change in (
        lambda: (room / "inner" / "b.py").write_text("c"),
        lambda: (room / "a.py").rename(room / "c.py"),
        lambda: (room / "inner" / "d.py").write_text(""),
    ):
        change()
        seen.append(digest_of_sources([room]))
    assert len(set(seen)) == 4
    (room / "notes.txt").write_text("another")
    assert digest_of_sources([room]) == seen[-1]


def test_the_digest_is_of_our_sources() -> None:
    rooms = [Path(schedule_cache.__file__).parent.parent / name for name in ("model", "gateware")]
    assert digest_of_sources(rooms) == schedule_cache._SOURCES
    assert {p.name for p in rooms[1].rglob("*.py")} > {"search.py", "list_pass.py", "machine.py"}
    assert {p.name for p in rooms[0].rglob("*.py")} > {"rounded.py", "program.py"}


@pytest.mark.parametrize("damage", ["", "[[], [], 1]", None])
def test_a_broken_entry_is_not_used(
    damage: str | None, folder: Path, searches: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = kept(random_program(1))
    (file,) = folder.glob("builds/schedule-*/schedule.json")
    if damage is None:
        file.write_text(file.read_text().replace("0", "1", 1))  # as long as it was
    else:
        file.write_text(damage)
    assert kept(random_program(1)) == first and len(searches) == 2
    assert kept(random_program(1)) == first and len(searches) == 2


def test_what_does_not_fit_leaves_nothing(folder: Path) -> None:
    with pytest.raises(ScheduleError):
        kept(random_program(1), dataclasses.replace(SMALL, rom_words=16))
    assert not list(folder.glob("builds/schedule-*")) and not list(folder.glob("work-*"))


@pytest.mark.full_search
def test_an_effort_of_ones_own_is_not_kept(folder: Path, searches: list[str]) -> None:
    build_core(random_program(2), "small", restarts=1)
    assert not folder.exists() and not searches
    build_core(random_program(2), "small")
    assert searches == ["small"] and len(list(folder.glob("builds/schedule-*"))) == 1


@pytest.mark.parametrize("before", [True, False])
def test_a_full_disk_is_no_obstacle(
    before: bool, searches: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = kept(random_program(3))

    def full(_self: object, _name: str, _identity: str, make: Callable[[Path], None]) -> None:
        if not before:
            make(Path("/nowhere"))
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(cache.Cache, "get", full)
    assert kept(random_program(3)) == first and len(searches) == 2
