"""Compare integer model, C and RTL on logs, bit by bit, and with float64.

boresight check my_filter.py log.csv  # all forms
boresight check my_filter.py my_world.py:World  # on the records of a world
boresight check my_filter.py first.csv folder -o build  # several logs; a page and its JSON
boresight check my_filter.py log.csv --levels fixed,c --word 24  # without RTL, in narrow words
boresight check one.py,two.py log.csv  # both on one core, in turns
boresight check one.py,two.py one=log.csv two=motor.csv  # each with its own log
boresight check my_filter.py log.csv --baseline check.json  # also against an earlier --json
boresight check build log.csv  # the Verilog and C in the folder that compile wrote
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from boresight import options
from boresight.builds import build_for, build_in, changes_in, is_folder
from boresight.gateware.machine import machine_named
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.words.fixed import check_word
from boresight.sim.compare.check import EXACT, Check
from boresight.sim.compare.results import CheckResult, verdict
from boresight.sim.levels.build import Build
from boresight.sim.records.files import Log, log_files, logs_of
from boresight.sim.result import Figure, Result
from boresight.sim.worlds.loop import recorded
from boresight.sim.worlds.world import is_world

GROUPS = (options.rows, options.profiles, options.tolerances, options.judged)

#: Figures of the result that can be compared with an earlier one.
JUDGED: Mapping[str, Figure] = {
    "results.*.config": Figure("config", "same"),
    "results.*.word": Figure("word", "same"),
    "results.*.good": Figure("good", "count", falls=True),
    "results.*.accuracy.outputs.*.samples": Figure("samples", "count", falls=True),
    "results.*.parameters.*": Figure("value", "parameter"),
    "results.*.program": Figure("program digest", "identity"),
    "results.*.waived.*": Figure("waived", "count"),
    "results.*.truth.*.tolerance": Figure("limit of the error from the truth", "parameter"),
    "results.*.truth.*.rms": Figure("error from the truth, rms", "truth"),
    "results.*.accuracy.outputs.*.unit": Figure("unit", "parameter"),
    "results.*.accuracy.outputs.*.float64.*": Figure("float64", "value"),
    "results.*.accuracy.outputs.*.max": Figure("fixed point from float64", "rounding"),
    "results.*.accuracy.saturated_updates": Figure("updates that saturated", "count"),
    "results.*.textbook.*.max": Figure("float64 from the textbook's form", "textbook"),
    "results.*.verification.*.cycles_predicted": Figure("latency", "cycles", "cycles"),
    "results.*.verification.*.interval_predicted": Figure("interval", "cycles", "cycles"),
}


def check(
    estimator: options.EstimatorNames,
    /,
    *logs: options.Logs,
    config: options.Config = "small",
    word: options.Word = 32,
    steps: options.Steps = None,
    levels: options.Level = EXACT,
    simulator: str | None = None,
    target: str | None = None,
    params: options.Params = None,
    output: options.OptionalFolder = None,
    progress: options.Progress = None,
) -> Result:
    """Compare the forms of an estimator on logs; see `sim.compare.check.Check`.

    Several estimators share one core, in turns. Of a folder that compile wrote the Verilog and C
    run, if no file has changed. Returns ``results``: one for each estimator on each log. Raises
    InputError for unknown names and bad logs: all of these (of a long one the first rows) are read
    before the first is checked.

    Parameters
    ----------
    logs : paths, worlds, or data in memory (`Record.of`)
        Logs, folders of logs, or worlds, whose loop with the float64 form is the log; with several
        estimators NAME=LOG gives each its own.
    levels : sequence of str
        Forms to compare: fixed, c, rtl.
    simulator : str, optional
        Simulator of the RTL: verilator or icarus; by default Verilator, or Icarus without it.
    target : str, optional
        Part that the core is for: xc6slx9 (the default), ecp5-25k, generic, ... It decides the
        depth of the machine as in compile, and the area on the page.
    params : mapping, optional
        Parameter values; for several estimators a mapping of each by its name.
    output : path, optional
        Folder for report.html and report.json, with area and clock; for one estimator.
    """
    require_whole("steps", steps, 1)
    machine_named(config.removesuffix("-d7"))
    check_word(word)
    levels = levels.split(",") if isinstance(levels, str) else levels
    part, choice = "xc6slx9" if target is None else target, ""
    require_choice("target", part, (*TARGETS, "generic"))
    if is_folder(estimator):
        if changes := changes_in(Path(estimator)):
            return Result({"results": []}, failures=changes)
        if (config, word, part, params) != ("small", 32, "xc6slx9", None):
            raise _of_folder(estimator, "one of them")
        build = build_in(Path(estimator))
    else:
        named = options.estimator_names(estimator)
        values = options.params_of_each(named, params)
        found = map(find_estimator, named)
        make = partial(Build, *found, word=word, params=values, target=part)
        build, choice = build_for(make, config, part)
    names = [e.name for e in build.estimators]
    fix = "leave -o out, or check each"
    good = output is None or len(names) == 1
    require(good, "--output", "one estimator", ", ".join(names), fix)
    messages: list[str] = []
    tell = progress or (lambda text: None)
    checking = Check(
        build,
        levels=levels,
        simulator=simulator,
        progress=lambda text: tell("".join((*messages, text))),
    )
    good = len(names) == 1 or not any(map(is_world, logs))
    fix = "record it: run ESTIMATOR WORLD -o log.csv"
    require(good, "logs", "logs of several estimators", "a world", fix)
    logs = tuple(recorded(log, build, steps) if is_world(log) else log for log in logs)
    shared, own = _shared_and_own(logs, names)
    rounds = [[each_log] for each_log in logs_of(shared, steps)]
    if own:
        for name in names:
            wanted = f"a log of {name}, since {', '.join(own)} has its own"
            require(name in own, "logs", wanted, None, f"write for example {name}=log.csv")
        rounds.append([Log.of(own[name], steps) for name in names])
    require(bool(rounds), "logs", "at least one log", None, "name a log file")
    results: list[CheckResult] = []
    for records in rounds:
        messages[:] = [", ".join(dict.fromkeys(r.name for r in records)), ": "]
        results += checking.run(*records)
    lines = [choice] if choice else []
    lines += [line for result in results for line in result.lines()]
    if output is not None:
        inputs = log_files(log for log in logs if isinstance(log, str | Path))
        from boresight.sim.report.page import write_report  # it imports plots and synthesis

        lines.append(write_report(Path(output), build, results, inputs, tell))
    good = all(r.good for r in results)
    return Result(
        {"results": results},
        summary="\n".join((*lines, "good") if good else lines),
        failures=() if good else (verdict(results).removeprefix("FAILED: "),),
        judged=JUDGED,
    )


def typed(words: Sequence[Any], given: Mapping[str, Any], shown: Any) -> dict[str, Any]:
    """Refuse options that a folder has, even one that repeats its default."""
    chosen = [name for name in ("config", "word", "target", "params") if name in given]
    if chosen and is_folder(words[0]):
        raise _of_folder(words[0], ", ".join(f"--{name.removesuffix('s')}" for name in chosen))
    return {}


def _of_folder(folder: str | Path, found: str) -> InputError:
    wanted = "no --config, --word, --target or --param: the folder has them"
    return InputError.at(str(folder), wanted=wanted, found=found, fix="leave it out")


def _shared_and_own(logs: Sequence[Any], names: Sequence[str]) -> tuple[list[Any], dict[str, Any]]:
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
