"""Choose the formats of values from runs of the estimator.

boresight fit my_filter.py log.csv  # a profile, which every verb finds beside the file
boresight fit my_filter.py folder world.py:World  # from several logs and a closed loop
boresight fit mekf log.csv -o mekf.fit.json  # for: check mekf log.csv --profile mekf.fit.json
boresight fit "board(field_ut=(0, 27.9, -46.2))" logs -o calibration.json  # registers of a board
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from boresight import options
from boresight.model.arrays import FloatArray
from boresight.model.errors import require, require_whole
from boresight.model.estimator import Estimator
from boresight.model.resolve import call_of, profile_place
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.settings import CURRENT, using
from boresight.model.tools.files import OutputFile
from boresight.model.words.fixed import check_word
from boresight.sim.boards import board_system
from boresight.sim.compare.diagnosis import IF_ALWAYS, NAMED
from boresight.sim.fit.fitting import WORSE, Effect, Fitted, fitted, select_ranges, wasted_ranges
from boresight.sim.fit.observe import Inputs
from boresight.sim.levels.build import Build
from boresight.sim.records.feed import feeds
from boresight.sim.records.files import Log, log_files, logs_of
from boresight.sim.result import Result
from boresight.sim.worlds.loop import recorded
from boresight.sim.worlds.world import is_world

GROUPS = (options.rows, options.tolerances)


def fit(
    estimator: options.EstimatorName,
    /,
    *sources: Annotated[Any, Parameter(metavar="LOG|WORLD", show_default=False)],
    params: options.Params = None,
    word: options.Word = 32,
    steps: options.Steps = None,
    output: options.OptionalFile = None,
    progress: options.Progress = None,
) -> Result:
    """Choose the formats of an estimator's values from runs, and write them as a profile.

    Every value is observed in float64 on the sources and in a stress test, with states in their
    declared ranges. Its format keeps `sim.fit.fitting.MARGIN_BITS` above the largest value, and
    half of the bits up to its computed range, at most `sim.fit.fitting.MOST_BITS`. Inputs,
    parameters, states and next states, angles that wrap, divisors and arguments of roots keep
    their formats. The profile is empty if it would make an output less exact
    (`sim.fit.fitting.select_ranges`). Nothing is written if no format is kept, a word saturates
    on the sources, or more variances are negative than without the profile.

    Of board, with settings, the calibration registers of the complete system are fitted to records
    of raw counts, and written as a file of parameters (docs/systems/ma2014.md).

    Returns ``errors`` before and after, by output; ``limits``, ``wasted``. Raises InputError for
    unknown names, bad logs, no source, and a divisor that has both signs.

    Parameters
    ----------
    sources : paths, data in memory (`Record.of`), worlds
        Logs, folders of logs, or worlds as FILE.py:CLASS; the estimator runs on them in float64.
    word : int
        Word width for the comparison; the profile serves every width.
    output : path, optional
        File of the profile; by default beside the estimator, where every verb finds it.
    """
    if isinstance(estimator, str) and estimator.partition("(")[0] == "board":
        accepted = CURRENT.get().tolerances or None
        for name, value in (("params", params), ("steps", steps), ("tolerance", accepted)):
            require(value is None, name, "none for a board", value, "leave it out")
        _, _, settings = call_of(estimator, estimator)
        result: Result = board_system().calibrate(sources, settings, output or "calibration.json")
        return result
    check_word(word)
    require_whole("steps", steps, 1)
    with using(profiles=()):
        found = copy.copy(find_estimator(estimator))
        values = options.params_of(estimator, params)
    found.profile = None
    fix = "name a log, or a world as file.py:Class"
    require(bool(sources), "logs", "at least one log or world", None, fix)
    place = Path(output or profile_place(estimator, found.name) or f"{found.name}.fit.json")
    files = log_files(s for s in sources if isinstance(s, str | Path) and not is_world(s))
    target = OutputFile(place, inputs=files)
    say = progress or (lambda text: None)
    build, records = Build(found, params=[values]), dict[str, Inputs]()
    logs = [recorded(s, build, steps) if is_world(s) else s for s in sources]
    for log in logs_of(logs, steps):
        name = log.name
        while name in records:
            name += f" {len(records) + 1}"
        records[name] = partial(_inputs, found, log)
    fit_result = fitted(found, records, params=values, progress=say)
    say("fixed point, by intervals and with the profile")
    choice = select_ranges(fit_result, records, params=values, word=word)
    before, after, profile = choice.before, choice.after, choice.profile
    fit_result = replace(fit_result, profile=profile)
    expressions = fit_result.trace.tracer.expressions
    had = None if isinstance(before, str) else before.negative_updates
    failures = []
    if after.saturated_updates:
        failures.append(
            f"not written: {after.saturated_updates} updates SATURATED in the records; "
            "boresight check names the first value"
        )
    elif after.negative_updates > (had or 0):
        without = "" if had is None else f", {had} without it"
        failures.append(
            f"not written: a variance is NEGATIVE after {after.negative_updates} stress-test "
            f"updates{without}: declare the ranges of the covariance's values with ops.bounded"
        )
    errors = _errors(before, after)
    formats = len(profile.ranges)
    gains_nothing = bool(errors) and all(e["before"] == e["after"] for e in errors)
    empty = (not formats or gains_nothing) and not place.exists()
    if not failures and not empty:
        target.write(_text(fit_result))
    dropped = _errors(before, choice.full) if choice.full is not after else []
    limits = [
        {"line": expressions[number].line, "low": low, "high": high}
        for number, (low, high) in profile.limits.items()
    ]
    wasted = wasted_ranges(fit_result, word)
    updates = fit_result.updates
    count = sum(1 for e in fit_result.trace.needed if e.args)
    runs = ", ".join(f"{name} ({n} updates)" for name, n in updates.items())
    lines = [
        f"{place}: {formats} formats of {count} values, from {runs} and "
        f"{fit_result.hostile_updates} stress-test updates"
    ]
    if isinstance(before, str):
        lines.append(f"without it: {before}")
    if formats and gains_nothing:
        lines.append("no error changes: the profile gains nothing in these records")
    if empty:
        lines.append("not written: without the profile the words are as exact")
    if dropped:
        worse = ", ".join(e["output"] for e in dropped if "less exact" in e["verdict"])
        lines.append(
            f"with every format from runs less exact: {worse or 'variances, or saturations'}; "
            "none is kept (docs/learn/ranges.md, Formats from runs)"
        )
    lines += [f"{x['line']}: held in [{x['low']:.3g}, {x['high']:.3g}]" for x in limits]
    lines += [f"{w}{IF_ALWAYS}" for w in wasted[:NAMED]]
    data = {
        "estimator": found.name,
        "profile": place,
        "records": updates,
        "hostile_updates": fit_result.hostile_updates,
        "values": count,
        "formats": formats,
        "limits": limits,
        "errors": errors,
        "dropped": dropped,
        "saturated_updates": after.saturated_updates,
        "negative_updates": (had, after.negative_updates),
        "word": word,
        "wasted": wasted,
    }
    beyond = ", ".join(e["output"] for e in errors if "BEYOND" in e["verdict"])
    warning = f"BEYOND the tolerance at {word} bits with the profile; boresight check says why"
    notes = [f"{beyond}: {warning}"] if beyond else []
    return Result(data, {"fixed point against float64": errors}, "\n".join(lines), notes, failures)


def _inputs(estimator: Estimator, log: Log) -> Iterator[tuple[FloatArray, bool]]:
    """Inputs (n, n_inputs) of a log, and whether each piece begins from the initial states."""
    for k, part in enumerate(feeds(estimator, log.blocks(1 << 16))):
        yield from part.spans(not k)


def _errors(before: Effect | str, after: Effect) -> list[dict[str, Any]]:
    """Largest difference of each output from float64, without the profile and with it."""
    earlier = {} if isinstance(before, str) else {d.output: d.largest for d in before.differences}
    rows = []
    for d in after.differences:
        ends = (earlier.get(d.output, math.nan), d.largest)
        old, new = (float(x) if math.isfinite(x) else None for x in ends)
        beyond = new is not None and d.tolerance is not None and new > d.tolerance
        worse = new is not None and old is not None and new > WORSE * old
        rows.append(
            {
                "output": d.output,
                "unit": d.unit,
                "before": old,
                "after": new,
                "accepted": d.tolerance,
                "verdict": ", ".join(["BEYOND"] * beyond + ["less exact with it"] * worse),
            }
        )
    return rows


def _text(fit_result: Fitted) -> str:
    profile, expressions = fit_result.profile, fit_result.trace.tracer.expressions
    head = {
        "estimator": profile.estimator,
        "record": profile.record,
        "made_from": [{"log": name, "updates": n} for name, n in fit_result.updates.items()],
        "hostile_updates": fit_result.hostile_updates,
    }
    parts = [json.dumps(head)[1:-1]]
    for name, ranges in (("values", profile.ranges), ("limits", profile.limits)):
        rows = (
            {
                "number": number,
                "line": expressions[number].line,
                "records": fit_result.seen.get(number),
                "chosen": chosen,
            }
            for number, chosen in ranges.items()
        )
        parts.append(f'"{name}": [\n' + ",\n".join(map(json.dumps, rows)) + "\n]")
    return "{" + ",\n".join(parts) + "}\n"
