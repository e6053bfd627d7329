"""Tune parameters on logs with true values, with cross-validation.

boresight tune my_filter.py folder -o tuned.json  # then: run ... --param @tuned.json
boresight tune mekf folder --folds 3  # cross-validated
boresight tune my_filter.py log.csv --only alpha --weight vel=0.5  # one parameter, other weights
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from boresight import options
from boresight.model.errors import require_whole
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import OutputFile
from boresight.model.words.fixed import check_word
from boresight.sim.accuracy import tuning
from boresight.sim.accuracy.figures import means
from boresight.sim.accuracy.runs import LogRuns, read_trials
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.records.files import log_files
from boresight.sim.result import Result, Row

GROUPS = (options.rows, options.profiles)


def tune(
    estimator: options.EstimatorName,
    /,
    *logs: options.Logs,
    names: Annotated[
        Sequence[str] | None, options.Texts, Parameter(name="--only", metavar="A,B,...")
    ] = None,
    weights: Annotated[
        Mapping[str, float] | Sequence[str] | None,
        options.Repeated,
        Parameter(name="--weight", metavar="OUTPUT=NUMBER"),
    ] = None,
    folds: int | None = None,
    rounds: int = 12,
    params: options.Params = None,
    word: options.Word = 32,
    jobs: options.Jobs = None,
    output: options.OptionalFile = None,
    progress: options.Progress = None,
) -> Result:
    """Tune parameters by a pattern search on the emitted C; see `sim.accuracy.tuning`.

    Returns ``parameters``, ``error`` before and after, ``cross_validation``. Raises InputError for
    unknown names, bad logs, no log with true values, and illegal numbers.

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs. Logs without true values are left out, with a warning.
    folds : int, optional
        Folds of the cross-validation; 1 for none. By default 3, or the number of logs.
    names : sequence of str, optional
        Parameters to tune; all by default.
    weights : mapping, optional
        Weight of the error of an output, or of an angle of an attitude; by default 1; repeatable.
    rounds : int
        Largest number of rounds of the search.
    params : mapping, optional
        Initial values, and values of parameters that are not tuned.
    output : path, optional
        JSON file with the result; ``--param @FILE`` reads it.
    """
    say = progress or (lambda text: None)
    made = find_estimator(estimator)
    start = made.param_values(options.params_of(estimator, params))
    axes = tuning.axes_of(made, start, names)
    check_word(word)
    require_whole("folds", folds, 1)
    require_whole("rounds", rounds, 1)
    require_whole("jobs", jobs, 1)
    files = log_files(log for log in logs if isinstance(log, str | Path))
    target = None if output is None else OutputFile(output, inputs=files)
    trials, notes = read_trials(logs, [made], comparisons=False)
    units = {name: unit for trial in trials for name, unit in trial.units.items()}
    given = options.numbers(weights, "--weight") if isinstance(weights, Sequence) else weights
    counted = tuning.weights_of(units, given)
    tests = tuning.folds_of(len(trials), folds)
    runs = LogRuns([trial.feeds[made.name] for trial in trials], word=word, jobs=jobs)
    say(f"{made.name}: {len(trials)} logs, {sum(map(len, runs.feeds)):,} samples; C")

    def scores(values: Mapping[str, float], indices: Sequence[int]) -> list[Mapping[str, float]]:
        return [fixed.errors for fixed, *_ in runs.run({**start, **values}, indices)]

    def search(indices: Sequence[int], subject: str) -> tuning.Tuned:
        return tuning.pattern_search(
            lambda values: figure(scores(values, indices)),
            axes,
            rounds,
            progress=lambda text: say(f"{subject}: {text}"),
        )

    every = range(len(trials))
    first = [fixed for fixed, *_ in runs.run(start)]
    before = [fixed.errors for fixed in first]
    figure = tuning.figure_of(counted, means(before))
    best = search(every, "all logs")
    held_out, cross = list[Mapping[str, float]](), list[Row]()
    for k, test in enumerate(tests):
        tuned = search([i for i in every if i not in test], f"fold {k + 1} of {len(tests)}")
        found = scores(tuned.values, test)
        held_out += found
        cross.append(
            {
                "test": [trials[i].name for i in test],
                "train_figure": tuned.history[-1],
                "test_figure": figure(found),
                "test_error": means(found),
                "parameters": tuned.values,
            }
        )
    words = [fixed for fixed, *_ in runs.run({**start, **best.values})]
    for trial, old, new in zip(trials, first, words, strict=True):
        notes += [f"{trial.name}: {text}" for text in old.notes or new.notes]
    saturated = sum(fixed.saturated or 0 for fixed in words)
    saturations = dict(sum((Counter(fixed.saturations) for fixed in words), Counter[str]()))
    at_start, at_end = means(before), means(fixed.errors for fixed in words)
    errors: list[Row] = [
        {
            "error": error,
            "before": at_start[error],
            "tuned": at_end[error],
            "held out": means(held_out).get(error),
            "unit": units.get(error, ""),
        }
        for error in at_start
    ]
    moved: list[Row] = [
        {
            "parameter": axis.param.name,
            "before": axis.start,
            "tuned": best.values[axis.param.name],
            "unit": axis.param.unit,
        }
        for axis in axes
    ]
    data = {
        "estimator": made.name,
        "parameters": {**start, **best.values},
        "units": units,
        "weights": {n: w for n, w in counted.items() if w},
        "error": {"default": at_start, "tuned": at_end},
        "trials": [
            {"trial": trial.name, "default": errors, "tuned": fixed.errors}
            for trial, errors, fixed in zip(trials, before, words, strict=True)
        ],
        "tuned_parameters": moved,
        "search": {"evaluations": best.evaluations, "history": best.history},
        "cross_validation": {"folds": cross, "mean_test_error": means(held_out)} if cross else None,
        "saturated_updates": saturated,
        "saturations": saturations,
        "word": word,
    }
    said = [f"tuned, {saturated_text(saturated, saturations)}"] if saturated else []
    said += [
        f"{p.name} ends at the {'lower' if value == p.low else 'upper'} end of its range, "
        f"{p.low:g} to {p.high:g}: a wider range may give a smaller error"
        for p, start_value in ((axis.param, axis.start) for axis in axes)
        if (value := best.values[p.name]) in (p.low, p.high) and value != start_value
    ]
    if not tests:
        why = "there is one log" if len(trials) == 1 else "there is one fold"
        said.append(f"no cross-validation, since {why}: the error on other logs is not known")
    summary = (
        f"{made.name}, W = {word}: {best.history[0]:.4g} to {best.history[-1]:.4g} in "
        f"{best.evaluations} evaluations over {len(trials)} logs"
    )
    tables = {"error, mean over the logs": errors, "parameters": moved}
    result = Result(data, tables, summary, [*said, *notes])
    if target is not None:
        target.write(json.dumps(result.to_json(), indent=1) + "\n")
        result = replace(result, summary=f"{summary}\nwritten: {output}")
    return result
