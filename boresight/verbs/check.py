"""`boresight check`: prove all levels equal on one or more logs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from boresight.arguments import check_machine, check_number
from boresight.disk.output import OutputFile, free_name
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of, progress_of, refuse_options
from boresight.sharing import estimator_names, params_of_each
from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.compare.check import EXACT, Check
from boresight.sim.compare.reproducer import load_reproducer, replay_reproducer
from boresight.sim.compare.results import CheckResult, verdict
from boresight.sim.levels.build import Build
from boresight.sim.records.files import log_files, read_logs, record_of
from boresight.sim.records.record import Record
from boresight.terminal import say

__all__ = ["CheckResults", "add_arguments", "call", "check"]

#: Where a difference is kept, unless said otherwise.
REPRODUCER = "reproducer.json"


@dataclass(frozen=True, eq=False)
class CheckResults(Answer, Sequence[CheckResult]):
    """What `check` gives: a sequence with one result for each estimator on each log.

    Attributes
    ----------
    results : tuple of CheckResult
        In the order of the logs.
    """

    results: tuple[CheckResult, ...]

    @property
    def good(self) -> bool:
        """All are good."""
        return all(r.good for r in self.results)

    def __len__(self) -> int:
        return len(self.results)

    @overload
    def __getitem__(self, index: int) -> CheckResult: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[CheckResult, ...]: ...
    def __getitem__(self, index: int | slice) -> CheckResult | tuple[CheckResult, ...]:
        return self.results[index]

    def to_json(self) -> JsonObject:
        """Plain data: ``good``, and ``results``."""
        return {"good": self.good, "results": plain(self.results)}

    def __str__(self) -> str:
        lines = [line for result in self.results for line in result.lines()]
        return "\n".join((*lines, verdict(self.results)))

    def _repr_html_(self) -> str:
        return "\n".join(result._repr_html_() for result in self.results)


def _shared_and_own(logs: Sequence[Any], names: Sequence[str]) -> tuple[list[Any], dict[str, Any]]:
    """Logs for all estimators, and those of one of several."""
    shared: list[Any] = []
    own: dict[str, Any] = {}
    for log in logs:
        name, equals, path = log.partition("=") if isinstance(log, str) else ("", "", "")
        if len(names) > 1 and equals and name in names:
            own[name] = path
        elif len(names) > 1 and isinstance(log, Mapping) and set(log) == set(names):
            own |= log
        else:
            shared.append(log)
    return shared, own


def _own_record(name: str, own: Mapping[str, Any]) -> Record:
    """The record of one of several estimators."""
    if name not in own:
        raise InputError.at(
            "logs",
            wanted=f"a log of {name}, since {', '.join(own)} has its own",
            found="none",
            fix=f"write for example {name}=log.csv",
        )
    return record_of(own[name])


def check(
    name: Named,
    *logs: Any,
    config: str = "small",
    word: int = 32,
    steps: int | None = None,
    levels: Sequence[str] = EXACT,
    simulator: str | None = None,
    params: Mapping[str, Any] | None = None,
    reproducer: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
    each: Callable[[CheckResult], None] | None = None,
) -> CheckResults:
    """Check an estimator on logs; see `sim.compare.check.Check`.

    ``name`` may be several names with commas: then one core holds them all and they take turns;
    ``params`` is then a mapping by estimator. ``logs`` are paths of logs or folders, or what
    `sim.records.record.Record.of` takes, each for all estimators; ``NAME=PATH``, or a mapping by
    their names, gives each of several its own. ``each`` is called with every result as soon as it
    is there.

    Returns
    -------
    CheckResults
        One for each estimator on each log.

    Raises
    ------
    InputError
        Unknown names, bad logs. All logs are read before the first is checked.
    """
    names = estimator_names(name)
    estimators = [find_estimator(n) for n in names]
    if steps is not None:
        check_number("steps", steps, 1)
    check_machine(config, word)
    build = Build(*estimators, config=config, word=word, params=params_of_each(names, params))
    told: list[str] = []
    tell = progress or (lambda text: None)
    checking = Check(
        build,
        levels=levels,
        simulator=simulator,
        progress=lambda text: tell("".join((*told, text))),
    )
    shared, own = _shared_and_own(logs, [e.name for e in estimators])
    files = log_files(x for x in (*shared, *own.values()) if isinstance(x, str | Path))
    target = None
    if reproducer is not None:
        of = ",".join(e.name for e in estimators)
        target = OutputFile(reproducer, "check", of=of, inputs=files, option="--reproducer")
    rounds = [[record] for record, _ in read_logs(shared)]
    if own:
        rounds.append([_own_record(e.name, own) for e in estimators])
    if not rounds:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    results: list[CheckResult] = []
    for records in rounds:
        told[:] = [", ".join(dict.fromkeys(r.name for r in records)), ": "]
        found = checking.run(*(r.head(steps) for r in records), reproducer=target)
        results += found
        if each is not None:
            for result in found:
                each(result)
    if target is not None and target.written:
        tell(f"the difference, to run again: {reproducer}")
    return CheckResults(tuple(results))


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "estimator",
        metavar="ESTIMATOR[,ESTIMATOR...]",
        help="estimator; several: all in one core, in turns; or the word replay",
    )
    parser.add_argument(
        "logs",
        nargs="+",
        metavar="LOG",
        help="logs, or folders of logs; of several estimators NAME=LOG gives one its own",
    )
    model_options(parser)
    parser.add_argument("--steps", type=int, help="leading samples of each log")
    parser.add_argument("--levels", default=",".join(EXACT), help=f"some of {','.join(EXACT)}")
    parser.add_argument("--simulator", help="verilator or icarus; default: what is there")
    parser.add_argument(
        "--reproducer",
        metavar="FILE",
        help=f"written when a level differs; run it with: boresight check replay FILE; default: "
        f"{REPRODUCER}, or one with a number where a file of yours has that name",
    )


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    levels = tuple(args.levels.split(","))
    if args.estimator == "replay":
        return _replay(args, levels)
    reproducer = args.reproducer
    if reproducer is None:
        reproducer = free_name(REPRODUCER, "check", option="--reproducer")
    results = check(
        args.estimator,
        *args.logs,
        config=args.config,
        word=args.word,
        steps=args.steps,
        levels=levels,
        simulator=args.simulator,
        params=params_of(args, estimator_names(args.estimator)),
        reproducer=reproducer,
        progress=progress_of(args),
        each=None if args.json else lambda result: say("\n".join(result.lines())),
    )
    return int(not results.good), results.to_json(), verdict(results)


def _replay(args: Namespace, levels: Sequence[str]) -> Outcome:
    """Run reproducers; all are good before the first is run. They hold their machine and inputs."""
    refuse_options(
        args,
        add_arguments,
        ("config", "word", "steps", "params", "param", "reproducer"),
        wanted="an estimator and a log",
        found="a reproducer, which holds its own",
    )
    Check(Build(), levels=levels, simulator=args.simulator)  # refuses what it does not know
    files = [Path(file) for file in args.logs]
    for file in files:
        load_reproducer(file)
    simulator = args.simulator or "verilator"
    lines = [
        line
        for file in files
        for line in replay_reproducer(file, levels=levels, simulator=simulator)
    ]
    return int(bool(lines)), {"differences": lines}, "\n".join(lines) or "no difference"
