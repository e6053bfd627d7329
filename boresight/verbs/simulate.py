"""The complete board, sensors at its pins; or a world and an estimator in a closed loop.

boresight simulate my_filter.py my_filter.py --on rtl  # a world and an estimator in a file
boresight simulate plant.py:Plant pi.py:Pi -o loop.csv  # what the loop saw, as a log
boresight simulate mekf --seconds 1  # the board
boresight simulate pointing.py --feed east=0.6  # one's own, behind the filter that it reads
boresight simulate --faults  # every fault of both sensors
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Any

from boresight.arguments import JOBS_MOST, check_optional
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.core import Core
from boresight.gateware.machine import machine_named
from boresight.loop import simulate_world
from boresight.model.attitude import ESTIMATORS, FILTERS
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, names_of_entry_points
from boresight.model.tools.files import output_folder
from boresight.options import (
    Arguments,
    Config,
    Jobs,
    Option,
    Outcome,
    OutputFolder,
    PythonOnly,
    Verb,
    outcome,
)
from boresight.sim.attitude.board.faults import (
    FaultTrial,
    fault_board,
    fault_names,
    fault_trial,
    trial_log,
)
from boresight.sim.attitude.board.setup import REAL
from boresight.sim.attitude.host.simulated import BoardResult, FaultsResult, fault_line
from boresight.sim.attitude.host.simulation import (
    BOARD_FILES,
    SHORT,
    SOURCES,
    default_log,
    write_board,
)
from boresight.sim.campaign import processes
from boresight.sim.records.files import FORMATS, record_of
from boresight.sim.worlds.world import WORLD_GROUP, world_of

__all__ = ["simulate", "simulate_faults"]

#: Longest simulated time, s: cycles are counted in 32 bits.
_LONGEST_S = 20.0


def simulate(
    name: Named | None = None,
    log: Any = None,
    *,
    config: Config = "small",
    seconds: float = 1.0,
    source: str = "heading",
    feed: Annotated[Mapping[str, float] | None, Option(metavar="NAME=VALUE")] = None,
    output: OutputFolder = "build",
    core: Core | None = None,
    progress: Callable[[str], None] | None = None,
) -> BoardResult:
    """Run the complete system with both sensors at its pins, at the real speeds.

    Writes ``board.html`` and ``board.json``. Every attitude frame that comes out of the host's line
    is compared, word by word, with the chain of integer models.

    Parameters
    ----------
    name : str, class or Estimator, optional
        Estimator of the long run, mekf by default. Beside it stand all filters, or with one that is
        none of them those that it reads (`Input.source`); they run for a short time.
    log : path, or data in memory (`Record.of`), optional
        Log with reference attitude; its rows are the samples, at 1024 a second whatever its own
        rate. By default a synthetic motion.
    seconds : float
        Length of the long run.
    source : str
        The compass sends heading or counts.
    feed : mapping, optional
        Values of inputs that no sensor gives, for their registers; repeatable.
    output : path
        Folder for the files; of a world a log of what its loop saw, by default none.
    core : Core, optional
        Of `gateware.attitude.system.programs.system_core`; by default one with all filters.

    Returns
    -------
    BoardResult
        What each filter did; ``board.json`` holds the same.

    Raises
    ------
    InputError
        Unknown filter or source, an estimator that the sensors cannot feed, a value that its
        register cannot hold, a length out of range, a log without attitude or too short.
    """
    say = progress or (lambda text: None)
    chosen = estimator_of("mekf" if name is None else name)
    filters = _beside(chosen)
    check_options(config=config, seconds=seconds, source=source)
    updates = round(seconds * REAL.rate_hz)
    record = default_log(updates) if log is None else record_of(log)
    if len(record) < max(updates, SHORT):
        raise InputError.at(
            f"log {record.name!r}",
            wanted=f"{max(updates, SHORT)} rows or more",
            found=str(len(record)),
            fix="give a longer log, or fewer --seconds",
        )
    if log is None and isinstance(name, str) and ".py" in name:
        say(f"no world named: the complete board; for a closed loop, simulate WORLD {name}")
    inputs = (log,) if isinstance(log, str | Path) else ()
    with output_folder(output, "simulate", files=BOARD_FILES, inputs=inputs) as folder:
        if core is None:
            names = ", ".join(estimator_of(f).name for f in filters)
            say(f"core with {names} and the calibration, {config}")
            core = system_core(filters, config=config)
        return write_board(
            folder, chosen.name, core, record, updates=updates, source=source, feed=feed, say=say
        )


def _beside(chosen: Estimator) -> Sequence[Named]:
    """The estimators of the board: all filters, or those that ``chosen`` reads, and it."""
    if chosen.name in FILTERS:
        return FILTERS
    sources = [i.source.partition(".")[0] for i in chosen.inputs if i.source]
    known = {*ESTIMATORS, *names_of_entry_points(ESTIMATOR_GROUP)}
    return [*(name for name in dict.fromkeys(sources) if name in known), chosen]


def check_options(*, config: str = "small", seconds: float = 1.0, source: str = "heading") -> None:
    """Raise InputError for options that no simulation takes."""
    machine_named(config)
    require_choice("source", source, SOURCES)
    if not 0.05 <= seconds <= _LONGEST_S:
        raise InputError.at(
            "seconds",
            wanted=f"0.05 to {_LONGEST_S:g}",
            found=f"{seconds:g}",
            fix="choose a length inside the range",
        )


def _filter(name: str | None) -> str:
    name = name or "mekf"
    require_choice("filter", name, FILTERS)
    return name


def simulate_faults(
    name: str | None = None,
    *,
    faults: Annotated[Sequence[str] | None, PythonOnly] = None,
    jobs: Jobs = None,
    progress: Callable[[str], None] | None = None,
) -> FaultsResult:
    """Run every fault of both devices on the complete board, each on a board of its own.

    Parameters
    ----------
    name : str, optional
        Filter, mekf by default.
    faults : sequence of str, optional
        Only these, as ``adis.absent`` or ``hmr.silence``.
    jobs : int, optional
        Simulators at once; by default one for each processor.

    Returns
    -------
    FaultsResult
        When each was seen, and what it did. ``progress`` has the row of each as it ends.

    Raises
    ------
    InputError
        Unknown filter or fault.
    """
    name = _filter(name)
    check_optional("jobs", jobs, 1, JOBS_MOST)
    every = fault_names()
    for fault in faults or ():
        require_choice("fault", fault, every)
    board, log = fault_board([name]), trial_log()
    assert board.verilog  # made once, before the threads that wait for the simulators

    def trial(fault: str) -> FaultTrial:
        result = fault_trial(board, *fault.split("."), log=log)
        if progress:
            progress(fault_line(result))
        return result

    with ThreadPoolExecutor(processes(jobs)) as threads:
        return FaultsResult(name, tuple(threads.map(trial, faults or every)))


def call(
    arguments: Arguments,
    name: Annotated[str | None, Option(metavar="ESTIMATOR")] = None,
    log: Annotated[str | None, Option(metavar="LOG")] = None,
    *,
    faults: bool = False,
) -> Outcome:
    """The board, its faults, or a world.

    Parameters
    ----------
    name : str, optional
        Estimator of the long run, by default mekf, also FILE.py:CLASS; or a world, of a file or of
        a package.
    log : path, optional
        Log with attitude, by default a synthetic motion; after a world, the estimator.
    faults : bool
        Every fault of both sensors instead: when seen, what it does.
    """
    typed = arguments.typed
    check_options(**{n: typed[n] for n in ("config", "seconds", "source") if n in typed})
    if name is not None and _is_world(name, log):
        arguments.only(simulate_world, wanted=_BOARD, found="a world")
        _refuse_of_world(log, faults=faults)
        return outcome(arguments.call(simulate_world, name, log))
    if faults:
        return _faults(arguments, name, log)
    if "jobs" in typed:
        raise InputError.at("--jobs", wanted="--faults", found="none", fix="leave --jobs out")
    instead = "name a world, FILE.py:Class, or "
    arguments.only(simulate, wanted="a world before it", found=_BOARD, instead=instead)
    result = arguments.call(simulate, name, log)
    return outcome(result, f"\n{typed.get('output', 'build')}/board.html")


def _faults(arguments: Arguments, name: str | None, log: str | None) -> Outcome:
    """Trials of faults."""
    if log is not None:
        raise InputError.at(
            "--faults",
            wanted="no log: the trials have a motion of their own",
            found=log,
            fix="leave it out",
        )
    arguments.only(
        simulate_faults,
        uses={simulate_world: "a world", simulate: _BOARD},
        found="trials of faults",
    )
    return outcome(arguments.call(simulate_faults, name))


#: What options of the board belong to.
_BOARD = "the simulation of the board"


def _refuse_of_world(estimator: str | None, *, faults: bool) -> None:
    """Raise InputError for a world alone, or with faults."""
    if faults:
        raise InputError.at("--faults", wanted=_BOARD, found="a world", fix="leave --faults out")
    if estimator is None:
        raise InputError.at(
            "simulate",
            wanted="a world and an estimator",
            found="a world alone",
            fix="name the estimator too: boresight simulate WORLD.py:Class ESTIMATOR",
        )


def _is_world(text: str, other: str | None) -> bool:
    """Whether a text names a world: in a file, or an entry point of an installed package.

    An estimator stands alone or before a log, and runs on the board.
    """
    if ".py" not in text:
        name = text.partition("(")[0]
        return name not in FILTERS and name in names_of_entry_points(WORLD_GROUP)
    if other is not None and not other.endswith(tuple(FORMATS)):
        return True
    try:
        world_of(text)
    except InputError:
        return False
    return True


VERB = Verb(simulate, simulate_world, simulate_faults, call=call)
