"""Tune parameters on logs with true values, with cross-validation.

boresight tune my_filter.py folder -o tuned.json  # then: run ... --param @tuned.json
boresight tune mekf folder --folds 3  # cross-validated
boresight tune my_filter.py log.csv --only alpha --weight vel=0.5  # one parameter, other weights
"""

from __future__ import annotations

import json
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
from boresight.sim.accuracy.runs import LogRuns, read_trials
from boresight.sim.accuracy.tuning import Tuning, axes_of, folds_of, weights_of
from boresight.sim.records.files import log_files
from boresight.sim.result import Result

GROUPS = (options.LogRows, options.Profiles)


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

    Parameters
    ----------
    estimator : str, class or Estimator
        Name, FILE.py or FILE.py:CLASS.
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

    Returns
    -------
    Result
        ``parameters``, ``error`` before and after, ``cross_validation``.

    Raises
    ------
    InputError
        Unknown names, bad logs, no log with true values, illegal numbers.
    """
    say = progress or (lambda text: None)
    made = find_estimator(estimator)
    values = made.param_values(options.params_of(estimator, params))
    axes = axes_of(made, values, names)
    check_word(word)
    require_whole("folds", folds, 1)
    require_whole("rounds", rounds, 1)
    require_whole("jobs", jobs, 1)
    files = log_files(log for log in logs if isinstance(log, str | Path))
    target = None if output is None else OutputFile(output, inputs=files)
    trials, notes = read_trials(logs, [made], comparisons=False)
    units = {name: unit for trial in trials for name, unit in trial.units.items()}
    given = options.numbers(weights, "--weight") if isinstance(weights, Sequence) else weights
    counted = weights_of(units, given)
    tests = folds_of(len(trials), folds)
    runs = LogRuns([trial.feeds[made.name] for trial in trials], word=word, jobs=jobs)
    say(f"{made.name}: {len(trials)} logs, {sum(map(len, runs.feeds)):,} samples; C")
    result = Tuning(runs, axes, values, counted, rounds, say).result(
        [trial.name for trial in trials], units, tests
    )
    result = replace(result, data={**result.data, "word": word}, notes=(*result.notes, *notes))
    if target is not None:
        target.write(json.dumps(result.to_json(), indent=1) + "\n")
        result = replace(result, summary=f"{result.summary}\nwritten: {output}")
    return result
