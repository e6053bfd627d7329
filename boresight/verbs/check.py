"""`boresight check`: prove all levels equal on one or more logs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.arguments import check_choice, check_machine, check_number
from boresight.disk.output import OutputFile, free_name
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of, progress_of
from boresight.sharing import estimator_names, params_of_each
from boresight.sim.compare.check import LEVELS, CheckResult
from boresight.sim.compare.check import check as check_log
from boresight.sim.compare.check_shared import check_shared, shared_core
from boresight.sim.compare.divergence import load_reproducer, replay_reproducer
from boresight.sim.records.files import read_record
from boresight.sim.records.reading import reason
from boresight.sim.records.record import Record
from boresight.sim.rtl.simulators import SIMULATORS
from boresight.terminal import say

__all__ = ["add_arguments", "call", "check", "log_files"]

#: Where a difference is kept, unless said otherwise.
REPRODUCER = "reproducer.json"


def log_files(paths: Iterable[str | Path]) -> list[Path]:
    """Logs named by paths; a folder stands for every .csv and .npz below it.

    Raises
    ------
    InputError
        A folder without logs.
    """
    out: list[Path] = []
    for path in paths:
        try:
            found = _logs_below(Path(path))
        except OSError as error:
            raise InputError.at(
                str(path) or "''",
                wanted="a log, or a folder of logs",
                found=reason(error),
                fix="check the path",
            ) from None
        if not found:
            raise InputError.at(
                str(path),
                wanted="a log, or a folder with .csv or .npz logs",
                found="a folder without any",
                fix="name a log file",
            )
        out += found
    return out


def _logs_below(path: Path) -> list[Path]:
    """The path itself, or every log in that folder."""
    if not path.is_dir():
        return [path]
    return sorted(p for p in path.rglob("*") if p.suffix in (".csv", ".npz"))


def _records(log: Any) -> list[Record]:
    """Those of a path, of which a folder holds several, or the one in memory."""
    if isinstance(log, str | Path):
        return [read_record(path) for path in log_files([log])]
    return [Record.of(log)]


def check_options(
    *, config: str, word: int, steps: int | None, levels: Sequence[str], simulator: str | None
) -> None:
    """Raise InputError for what no check can be told, whatever its levels use of it."""
    check_machine(config, word)
    if steps is not None:
        check_number("steps", steps, 1)
    for level in levels:
        check_choice("levels", level, LEVELS)
    if simulator is not None:
        check_choice("simulator", simulator, SIMULATORS)


def check(
    name: Named,
    *logs: Any,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    levels: Sequence[str] = ("fixed", "c", "rtl"),
    simulator: str | None = None,
    params: Mapping[str, Any] | None = None,
    reproducer: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
    each: Callable[[CheckResult], None] | None = None,
) -> list[CheckResult]:
    """Check an estimator on logs; see `sim.compare.check.check`.

    ``name`` may be several names with commas: then one core holds them all and they take turns
    (`sim.compare.check_shared.check_shared`); ``params`` is then a mapping by estimator. ``logs``
    are paths of logs or folders, or what `sim.records.record.Record.of` takes. ``each`` is called
    with every result as soon as it is there.

    Raises
    ------
    InputError
        Unknown names, bad logs. All logs are read before the first is checked.
    """
    names = estimator_names(name)
    estimators = [find_estimator(n) for n in names]
    chosen = params_of_each(names, params)
    for estimator, values in zip(estimators, chosen, strict=True):
        estimator.param_values(values)
    check_options(config=config, word=word, steps=steps, levels=levels, simulator=simulator)
    files = log_files(x for x in logs if isinstance(x, str | Path))
    target = None
    if reproducer is not None:
        target = OutputFile(
            reproducer,
            "check",
            of=",".join(e.name for e in estimators),
            inputs=files,
            option="--reproducer",
        )
    read = [record for log in logs for record in _records(log)]
    if not read:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    results = []
    core = None
    for log in read:
        say = None if progress is None else (lambda text, log=log: progress(f"{log.name}: {text}"))
        if len(names) > 1:
            if core is None and "rtl" in levels:
                core = shared_core(estimators, config=config, word=word, params=chosen)
            found = check_shared(
                estimators,
                log,
                config=config,
                word=word,
                steps=steps,
                levels=levels,
                simulator=simulator,
                params=chosen,
                core=core,
                progress=say,
            )
        else:
            found = [
                check_log(
                    estimators[0],
                    log,
                    config=config,
                    word=word,
                    steps=steps,
                    levels=levels,
                    simulator=simulator,
                    params=chosen[0],
                    reproducer=target,
                    progress=say,
                )
            ]
        results += found
        if each is not None:
            for result in found:
                each(result)
    if target is not None and target.written and progress is not None:
        progress(f"the difference, to run again: {reproducer}")
    return results


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "estimator",
        metavar="ESTIMATOR[,ESTIMATOR...]",
        help="estimator; several: all in one core, in turns; or the word replay",
    )
    parser.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    model_options(parser)
    parser.add_argument("--steps", type=int, help="leading samples of each log")
    parser.add_argument("--levels", default="fixed,c,rtl", help=f"some of {','.join(LEVELS)}")
    parser.add_argument("--simulator", help="verilator or icarus; default: what is there")
    parser.add_argument(
        "--reproducer",
        metavar="FILE",
        help=f"written when a level differs; run it with: boresight check replay FILE; default: "
        f"{REPRODUCER}, or one with a number where a file of yours has that name",
    )


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    if args.estimator == "replay":
        check_options(
            config=args.config,
            word=args.word,
            steps=args.steps,
            levels=args.levels.split(","),
            simulator=args.simulator,
        )
        for file in args.logs:
            load_reproducer(Path(file))  # all are good before the first is run
        simulator = args.simulator or "verilator"
        lines = [
            line
            for file in args.logs
            for line in replay_reproducer(Path(file), simulator=simulator)
        ]
        return int(bool(lines)), {"differences": lines}, "\n".join(lines) or "no difference"

    def show(result: CheckResult) -> None:
        if args.json:
            return
        say(f"{result.estimator} on {result.log}, {result.config}, W = {result.word}")
        for level in result.levels:
            say(f"  {level.line()}")
        for text in (*result.accuracy.lines(), *(f"warning: {w}" for w in result.warnings)):
            say(f"  {text}")

    names = estimator_names(args.estimator)
    reproducer = args.reproducer
    if reproducer is None:
        reproducer = free_name(REPRODUCER, "check", option="--reproducer")
    results = check(
        args.estimator,
        *args.logs,
        config=args.config,
        word=args.word,
        steps=args.steps,
        levels=tuple(args.levels.split(",")),
        simulator=args.simulator,
        params=params_of(args, names),
        reproducer=reproducer,
        progress=progress_of(args),
        each=show,
    )
    good = all(r.good for r in results)
    return (
        0 if good else 1,
        {"good": good, "results": [r.to_json() for r in results]},
        "good" if good else "FAILED",
    )
