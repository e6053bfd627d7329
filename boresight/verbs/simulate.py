"""The complete board, sensors at its pins; or a world and an estimator in a closed loop.

boresight simulate my_filter.py my_filter.py --on rtl  # a world and an estimator in a file
boresight simulate plant.py:Plant pi.py:Pi -o loop.csv  # what the loop saw, as a log
boresight simulate mekf --seconds 1  # the board
boresight simulate pointing.py --feed east=0.6  # one's own, behind the filter that it reads
boresight simulate --faults  # every fault of both sensors
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from boresight.gateware.core import Core
from boresight.loop import simulate_world
from boresight.model.errors import InputError
from boresight.model.resolve import Named, names_of_entry_points
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
from boresight.sim.boards import board_system
from boresight.sim.records.files import FORMATS
from boresight.sim.worlds.world import WORLD_GROUP, world_of

__all__ = ["simulate", "simulate_faults"]


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
) -> Any:
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
        A core of the system; by default one with all filters is compiled.

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
    if log is None and isinstance(name, str) and ".py" in name:
        say(f"no world named: the complete board; for a closed loop, simulate WORLD {name}")
    system = board_system()
    inputs = (log,) if isinstance(log, str | Path) else ()
    with output_folder(output, "simulate", files=system.files, inputs=inputs) as folder:
        return system.simulate(
            folder,
            name,
            log,
            config=config,
            seconds=seconds,
            source=source,
            feed=feed,
            core=core,
            say=say,
        )


def simulate_faults(
    name: str | None = None,
    *,
    faults: Annotated[Sequence[str] | None, PythonOnly] = None,
    jobs: Jobs = None,
    progress: Callable[[str], None] | None = None,
) -> Any:
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
    return board_system().simulate_faults(name, faults=faults, jobs=jobs, progress=progress)


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
        return name in names_of_entry_points(WORLD_GROUP)
    if other is not None and not other.endswith(tuple(FORMATS)):
        return True
    try:
        world_of(text)
    except InputError:
        return False
    return True


VERB = Verb(simulate, simulate_world, simulate_faults, call=call)
