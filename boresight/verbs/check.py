"""Compare integer model, C and RTL on logs, bit by bit, and with float64.

boresight check my_filter.py log.csv  # all levels
boresight check mekf first.csv folder  # several logs, or folders of logs
boresight check mekf log.csv --levels fixed,c --word 24  # without RTL, in narrow words
boresight check mekf log.csv --levels fixed,netlist --target ecp5-25k --config small-d9  # as mapped
boresight check complementary,mekf log.csv  # taking turns on one core
boresight check mekf,pi.py mekf=log.csv pi=motor.csv  # each with its own log
boresight check my_filter.py log.csv --baseline check.json  # also beside an earlier --json
boresight check mekf log.csv --wave 1200:1210  # also the core's signals in these rows, to look at
boresight check replay reproducer.json  # a difference that was found, again
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, overload

from boresight.arguments import check_machine, check_optional, check_target, check_urgent
from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import OutputFile
from boresight.options import (
    Arguments,
    Config,
    EstimatorNames,
    Logs,
    Option,
    Outcome,
    Params,
    Urgent,
    Word,
)
from boresight.regression import JudgedVerb
from boresight.sharing import estimator_names, params_of_each
from boresight.sim.answer import Answer, Figure, JsonObject, plain
from boresight.sim.compare.check import ROWS, USUAL, Check
from boresight.sim.compare.reproducer import load_reproducer, replay_reproducer
from boresight.sim.compare.results import CheckResult, verdict
from boresight.sim.levels.build import Build
from boresight.sim.levels.synthesised import NetlistSimulated
from boresight.sim.records.log import Log, logs_of
from boresight.sim.rtl.netlist import SIMULATED
from boresight.terminal import say
from boresight.waves import WAVE_FOLDER, write_waves

__all__ = ["CheckResults", "check"]

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

    judged: ClassVar[Mapping[str, Figure]] = {
        "results.*.config": Figure("config", "same"),
        "results.*.word": Figure("word", "same"),
        "results.*.good": Figure("good", "count", falls=True),
        "results.*.accuracy.outputs.*.samples": Figure("samples", "count", falls=True),
        "results.*.accuracy.outputs.*.max": Figure("largest error", "error"),
        "results.*.accuracy.outputs.*.rms": Figure("error, rms", "error"),
        "results.*.accuracy.saturated_updates": Figure("updates that saturated", "count"),
        "results.*.textbook.*.max": Figure("from the textbook's form", "error"),
        "results.*.verification.*.cycles_predicted": Figure("latency", "cycles", "cycles"),
        "results.*.verification.*.interval_predicted": Figure("interval", "cycles", "cycles"),
    }

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
        name = name.removesuffix(".py")
        if len(names) > 1 and equals and name in names:
            own[name] = path
        elif len(names) > 1 and isinstance(log, Mapping) and set(log) == set(names):
            own |= log
        else:
            shared.append(log)
    return shared, own


def _own_log(name: str, own: Mapping[str, Any], steps: int | None) -> Log:
    """The log of one of several estimators."""
    if name not in own:
        raise InputError.at(
            "logs",
            wanted=f"a log of {name}, since {', '.join(own)} has its own",
            found="none",
            fix=f"write for example {name}=log.csv",
        )
    return Log.of(own[name], steps)


def check(
    name: EstimatorNames,
    *logs: Logs,
    config: Config = "small",
    word: Word = 32,
    steps: int | None = None,
    levels: Sequence[str] = USUAL,
    simulator: str | None = None,
    target: str | None = None,
    params: Params = None,
    urgent: Urgent = None,
    reproducer: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    rtl_rows: Annotated[int | None, Option(metavar="N")] = None,
    wave: Annotated[str | None, Option(metavar="FIRST:STOP")] = None,
    wave_folder: Annotated[str | Path, Option(metavar="DIR")] = WAVE_FOLDER,
    progress: Callable[[str], None] | None = None,
    each: Callable[[CheckResult], None] | None = None,
    rows: Annotated[int | None, Option(hidden=True)] = None,
) -> CheckResults:
    """Check an estimator on logs; see `sim.compare.check.Check`.

    Parameters
    ----------
    name : str, class or Estimator
        Name, or FILE.py:CLASS; several with commas: all in one core, in turns. On the command
        line also the word replay, before reproducers.
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs; with several estimators NAME=LOG, or a mapping by their names,
        gives each its own.
    steps : int, optional
        Leading samples of each log.
    levels : sequence of str
        Some of fixed, c, rtl, netlist (the core after synthesis for a target).
    simulator : str, optional
        verilator or icarus; by default what is there.
    target : str, optional
        Part of the level netlist: xc6slx9, the default, ecp5-25k, ...
    params : mapping, optional
        Values other than the defaults; of several estimators such a mapping of each by its name.
    reproducer : path, optional
        Written when a level differs; `boresight check replay FILE` runs it. The command line
        writes reproducer.json by default, unless a file of yours has that name.
    rtl_rows : int, optional
        Rows of each log that run in RTL, as 16 slices spread over it, each from the states of the
        integer model; by default all of them, from a reset on.
    wave : str, optional
        Rows of the log, FIRST:STOP without the last, whose signals of the core are written as
        waveforms, with the program's names.
    wave_folder : path
        Folder for them.
    each : callable, optional
        Called with every result as soon as it is there.
    rows : int, optional
        Rows that run on a level at a time; the results are the same with any number.

    Returns
    -------
    CheckResults
        One for each estimator on each log.

    Raises
    ------
    InputError
        Unknown names, bad logs. All logs are read before the first is checked; of a long file the
        first rows.
    """
    names = estimator_names(name)
    estimators = [find_estimator(n) for n in names]
    check_optional("steps", steps, 1)
    check_optional("rtl_rows", rtl_rows, 1)
    check_machine(config, word)
    check_urgent(urgent, estimators)
    build = Build(
        *estimators,
        config=config,
        word=word,
        params=params_of_each(names, params),
        urgent=urgent,
        target=_simulated(target, levels),
    )
    messages: list[str] = []
    tell = progress or (lambda text: None)
    checking = Check(
        build,
        levels=levels,
        simulator=simulator,
        progress=lambda text: tell("".join((*messages, text))),
    )
    shared, own = _shared_and_own(logs, [e.name for e in estimators])
    rounds = [[each_log] for each_log in logs_of(shared, steps)]
    if own:
        rounds.append([_own_log(e.name, own, steps) for e in estimators])
    if not rounds:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    kept = None
    if reproducer is not None:
        files = [log.path for records in rounds for log in records if log.path]
        kept = OutputFile(reproducer, inputs=files, option="--reproducer")
    if wave is not None:
        tell(write_waves(build, rounds, wave, wave_folder))
    results: list[CheckResult] = []
    for records in rounds:
        messages[:] = [", ".join(dict.fromkeys(r.name for r in records)), ": "]
        checked = checking.run(
            *records, reproducer=kept, keep_all=False, rows=rows or ROWS, rtl_rows=rtl_rows
        )
        results += checked
        if each is not None:
            for result in checked:
                each(result)
    if kept is not None and kept.written:
        tell(f"the difference, to run again: {reproducer}")
    return CheckResults(tuple(results))


def _simulated(target: str | None, levels: Sequence[str]) -> str:
    """The part of the level netlist."""
    if target is None:
        return "xc6slx9"
    check_target(target, SIMULATED)
    if NetlistSimulated.name not in levels:
        raise InputError.at(
            "target",
            wanted="the level netlist, which runs the core after synthesis for it",
            found=f"--levels {','.join(levels)}",
            fix="say --levels fixed,netlist, or leave --target out",
        )
    return target


def replay(
    *files: str | Path,
    levels: Sequence[str] = USUAL,
    simulator: str | None = None,
    target: str | None = None,
) -> list[str]:
    """Run reproducers, which hold their machine and inputs; all are read before the first is run.

    Returns
    -------
    list of str
        A line for each difference.
    """
    Check(Build(), levels=levels, simulator=simulator)  # refuses what it does not know
    part = _simulated(target, levels)
    for file in files:
        load_reproducer(Path(file))
    return [
        line
        for file in files
        for line in replay_reproducer(
            Path(file), levels=levels, simulator=simulator or "verilator", target=part
        )
    ]


def call(arguments: Arguments) -> Outcome:
    """Check, or run reproducers."""
    typed = arguments.typed
    if typed["name"] == "replay":
        del typed["name"]
        files = typed.pop("logs")
        mode = "a reproducer, which holds its own"
        arguments.only(replay, wanted="an estimator and a log", found=mode)
        lines = arguments.call(replay, *files)
        return int(bool(lines)), {"differences": lines}, "\n".join(lines) or "no difference"
    if "reproducer" not in typed:
        with suppress(InputError):  # a file of the user, or a folder that cannot be written
            OutputFile(REPRODUCER)
            typed["reproducer"] = REPRODUCER
    each = None if arguments.json else lambda result: say("\n".join(result.lines()))
    results = arguments.call(check, each=each)
    return int(not results.good), results.to_json(), verdict(results)


VERB = JudgedVerb(check, replay, call=call, judged=CheckResults.judged)
