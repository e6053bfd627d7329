"""`boresight simulate`: the complete board in simulation, from sensor pins to the host's line."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.arguments import check_choice
from boresight.board.simulated import BoardResult, FaultsResult
from boresight.board.simulation import BOARD_FILES, SHORT, SOURCES, default_log, write_board
from boresight.disk.output import output_folder
from boresight.gateware.core import Core
from boresight.gateware.machine import ALL_CONFIGS
from boresight.gateware.system.programs import system_core
from boresight.loop import simulate_world, world_of
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.estimators import ESTIMATORS, FILTERS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, names_of_entry_points
from boresight.options import Outcome, model_options, params_of, progress_of, refuse_options
from boresight.parameters import parse_settings
from boresight.sim.board.faults import fault_board, fault_names, fault_trial, trial_log
from boresight.sim.board.setup import REAL
from boresight.sim.records.files import record_of
from boresight.sim.worlds.world import WORLD_GROUP

__all__ = ["add_arguments", "call", "simulate", "simulate_faults"]

#: Longest simulated time, s: cycles are counted in 32 bits.
_LONGEST_S = 20.0


def simulate(
    name: Named | None = None,
    log: Any = None,
    *,
    config: str = "small",
    seconds: float = 1.0,
    source: str = "heading",
    feed: Mapping[str, float] | None = None,
    output: str | Path = "build",
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
    config : str
        "small" or "fast", or with twice the registers "small-1024" or "fast-1024".
    seconds : float
        Length of the long run.
    source : str
        The compass sends "heading" or "counts".
    feed : mapping, optional
        Values of inputs that no sensor gives, for their registers.
    output : path
        Folder.
    core : Core, optional
        Of `gateware.system.programs.system_core`; by default one with all filters is compiled.

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
    given = default_log(updates) if log is None else record_of(log)
    if len(given) < max(updates, SHORT):
        raise InputError.at(
            f"log {given.name!r}",
            wanted=f"{max(updates, SHORT)} rows or more",
            found=str(len(given)),
            fix="give a longer log, or fewer --seconds",
        )
    inputs = (log,) if isinstance(log, str | Path) else ()
    with output_folder(
        output, "simulate", of=chosen.name, files=BOARD_FILES, inputs=inputs
    ) as folder:
        if core is None:
            names = ", ".join(estimator_of(f).name for f in filters)
            say(f"core with {names} and the calibration, {config}")
            core = system_core(filters, config=config)
        return write_board(
            folder, chosen.name, core, given, updates=updates, source=source, feed=feed, say=say
        )


def _beside(chosen: Estimator) -> Sequence[Named]:
    """The estimators of the board: all filters, or those that ``chosen`` reads, and it."""
    if chosen.name in FILTERS:
        return FILTERS
    sources = [i.source.partition(".")[0] for i in chosen.inputs if i.source]
    known = {*ESTIMATORS, *names_of_entry_points(ESTIMATOR_GROUP)}
    return [*(name for name in dict.fromkeys(sources) if name in known), chosen]


def check_options(*, config: str, seconds: float, source: str) -> None:
    """Raise InputError for what no simulation can be told."""
    check_choice("config", config, ALL_CONFIGS)
    check_choice("source", source, SOURCES)
    if not 0.05 <= seconds <= _LONGEST_S:
        raise InputError.at(
            "seconds",
            wanted=f"0.05 to {_LONGEST_S:g}",
            found=f"{seconds:g}",
            fix="choose a length inside the range",
        )


def _filter(name: str | None) -> str:
    name = name or "mekf"
    check_choice("filter", name, FILTERS)
    return name


def simulate_faults(
    name: str | None = None,
    *,
    faults: Sequence[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> FaultsResult:
    """Run every fault of both devices on the complete board, one after another.

    Parameters
    ----------
    name : str, optional
        Filter, mekf by default.
    faults : sequence of str, optional
        Only these, as ``adis.absent`` or ``hmr.silence``.

    Returns
    -------
    FaultsResult
        When each was seen, and what it did.

    Raises
    ------
    InputError
        Unknown filter or fault.
    """
    name = _filter(name)
    every = fault_names()
    for fault in faults or ():
        check_choice("fault", fault, every)
    board, log = fault_board([name]), trial_log()
    trials = [
        fault_trial(board, *fault.split("."), log=log, progress=progress)
        for fault in faults or every
    ]
    return FaultsResult(name, tuple(trials))


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "filter",
        nargs="?",
        help="estimator of the long run, default mekf, also FILE.py:Class; or a world, its own "
        "or that of a package",
    )
    parser.add_argument(
        "log",
        nargs="?",
        help="log with attitude, default a synthetic motion; after a world, the estimator",
    )
    parser.add_argument("--on", help="of a world: the level in its loop, default c")
    parser.add_argument("--against", help="of a world: a second level, compared, default c")
    parser.add_argument("--steps", type=int, help="of a world: most records")
    model_options(parser)
    parser.add_argument("--seconds", type=float, default=1.0, help="of the long run")
    parser.add_argument("--source", default="heading", help="the compass sends heading or counts")
    parser.add_argument(
        "--feed",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="value of an input that no sensor gives, repeatable",
    )
    parser.add_argument(
        "--faults",
        action="store_true",
        help="every fault of both sensors instead: when seen, what it does",
    )
    parser.add_argument(
        "-o", "--output", metavar="DIR", help="default build; of a world: a log of what it saw"
    )


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    check_options(config=args.config, seconds=args.seconds, source=args.source)
    if args.filter is not None and _is_world(args.filter, args.log):
        return _call_world(args)
    refuse_options(
        args,
        add_arguments,
        ("on", "against", "steps", "word", "param", "params"),
        wanted="a world before it",
        found="the simulation of the board",
        instead="name a world, FILE.py:Class, or ",
    )
    if args.faults:
        if args.log is not None:
            raise InputError.at(
                "--faults",
                wanted="no log: the trials have a motion of their own",
                found=args.log,
                fix="leave it out",
            )
        refuse_options(
            args,
            add_arguments,
            (*_OF_BOARD, "config", "output"),
            wanted="the simulation of the board",
            found="trials of faults, which have their own",
        )
        found = simulate_faults(args.filter, progress=progress_of(args))
        return int(not found.good), found.to_json(), str(found)
    output = "build" if args.output is None else args.output
    result = simulate(
        args.filter,
        args.log,
        config=args.config,
        seconds=args.seconds,
        source=args.source,
        feed=parse_settings(args.feed, "--feed"),
        output=output,
        progress=progress_of(args),
    )
    return int(not result.good), result.to_json(), f"{result}\n{output}/board.html"


#: Options of the board's simulation alone.
_OF_BOARD = ("seconds", "source", "feed")


def _is_world(text: str, other: str | None) -> bool:
    """Whether a text names a world: in a file, or an entry point of an installed package.

    An estimator stands alone or before a log, and runs on the board.
    """
    if ".py" not in text:
        name = text.partition("(")[0]
        return name not in FILTERS and name in names_of_entry_points(WORLD_GROUP)
    if other is not None and not other.endswith((".csv", ".npz")):
        return True
    try:
        world_of(text)
    except InputError:
        return False
    return True


def _call_world(args: Namespace) -> Outcome:
    """A closed loop."""
    refuse_options(
        args,
        add_arguments,
        (*_OF_BOARD, "faults"),
        wanted="the simulation of the board",
        found="a world",
    )
    if args.log is None:
        raise InputError.at(
            "simulate",
            wanted="a world and an estimator",
            found="a world alone",
            fix="name the estimator too: boresight simulate WORLD.py:Class ESTIMATOR",
        )
    result = simulate_world(
        args.filter,
        args.log,
        on=args.on or "c",
        against=args.against or "c",
        config=args.config,
        word=args.word,
        params=params_of(args, [args.log]),
        steps=args.steps,
        output=args.output,
        progress=progress_of(args),
    )
    return int(not result.good), result.to_json(), str(result)
