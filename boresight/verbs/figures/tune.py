"""Fit parameters to logs with truth, in the open, with cross-validation.

boresight tune my_filter.py folder -o tuned.json  # then: run ... --params tuned.json
boresight tune mekf folder --folds 3 --detune 3  # what is left from a detuned start
boresight tune my_filter.py log.csv --only alpha --weight vel=0.5  # one, with weights
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

from boresight.arguments import JOBS_MOST, check_number, check_optional, check_word
from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import OutputFile
from boresight.options import (
    Arguments,
    EstimatorName,
    Jobs,
    Logs,
    Option,
    Outcome,
    Params,
    Verb,
    Word,
    outcome,
)
from boresight.results.tune import (
    CrossValidation,
    TunedParameter,
    TuneErrors,
    TuneFold,
    TuneResult,
    TuneSearch,
    TuneTrial,
)
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.search import Tuned, deal_named, tunable
from boresight.sim.accuracy.tuning import Fold, Objective, Tuning, detuned, means, weights_of
from boresight.sim.records.files import log_files
from boresight.verbs.figures.trials import trials_of

__all__ = ["tune"]

#: What the figures are, for people.
SOURCE = (
    "root mean square error against truth of the emitted C (the core's words), mean over the "
    "trials; of an attitude the angles, by BROAD's method, in deg"
)


def tune(
    name: EstimatorName,
    *logs: Logs,
    folds: int | None = None,
    seed: int | None = None,
    names: Annotated[Sequence[str] | None, Option(("--only",), "A,B,...")] = None,
    weights: Annotated[Mapping[str, float] | None, Option(("--weight",), "OUTPUT=NUMBER")] = None,
    rounds: int = 12,
    detune: Annotated[float, Option(metavar="FACTOR")] = 1.0,
    vary: Annotated[float, Option(metavar="FACTOR")] = 2.0,
    params: Params = None,
    word: Word = 32,
    jobs: Jobs = None,
    output: Annotated[str | Path | None, Option(("-o", "--output"), "PARAMS.json")] = None,
    progress: Callable[[str], None] | None = None,
) -> TuneResult:
    """Tune parameters by a pattern search on the emitted C; see `sim.accuracy.tuning`.

    Parameters
    ----------
    name : str, class or Estimator
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs. Those without truth are named and left out.
    folds : int, optional
        Of the cross-validation; 1: none. By default 3, or as many as there are logs.
    seed : int, optional
        Shuffle the trials before they are dealt to the folds; by default in order of their names.
    names : sequence of str, optional
        Parameters to tune; all that can be moved by factors by default.
    weights : mapping, optional
        How much an error counts (of an output, or an angle of an attitude), repeatable, on top of
        the defaults: 1, of an attitude its angle.
    rounds : int
        Most rounds of each search; 0: none, the sensitivities of what is given alone.
    detune : float
        Start from values off by this factor (over and times it, in turn): if the start itself was
        tuned on these trials, the folds do not inherit that.
    vary : float
        Factor of the sensitivities.
    params : mapping
        Values to start from, and to hold where they are not tuned; files as tune writes them.
    output : path, optional
        JSON file with the result; ``--params`` reads it.

    Returns
    -------
    TuneResult
        Parameters, errors before and after, sensitivity, cross-validation and how it was done.

    Raises
    ------
    InputError
        Unknown names, bad logs, no trial with truth, illegal numbers.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    values = estimator.param_values(params)
    moving = tunable(estimator, values, names)
    _check_numbers(word=word, folds=folds, rounds=rounds, jobs=jobs, seed=seed)
    _check_factors(detune=detune, vary=vary)
    files = log_files(log for log in logs if isinstance(log, str | Path))
    target = None if output is None else OutputFile(output, inputs=files)
    trials = trials_of(estimator, logs)
    chosen = weights_of(trials.units, weights)
    tests = deal_named(trials.names, folds if rounds else 1, seed)
    count, many = len(trials.feeds), sum(map(len, trials.feeds))
    say(f"{estimator.name}: {count} trial{'s' * (count != 1)}, {many:,} samples; C")
    scorer = Scorer(estimator, trials.feeds, word=word, jobs=jobs)
    objective = Objective.of(chosen, means(scorer.scores(values)))
    tuning = Tuning(scorer, moving, detuned(values, moving, detune), objective, rounds, say)
    tuned = tuning.search(range(len(trials.feeds)), "all trials")
    held = tuning.folds(tests)
    say("sensitivities")
    error, each = _errors(tuning, trials.names, values, tuned.values)
    result = TuneResult(
        estimator=estimator.name,
        parameters={**tuning.start, **tuned.values},
        word=word,
        source=SOURCE,
        units=trials.units,
        weights=chosen,
        error=error,
        trials=each,
        tuned_parameters=_moved(tuning, values, tuned.values),
        search=_search(tuning, tuned, detune),
        without_truth=trials.left_out,
        vary=vary,
        sensitivity=tuple(tuning.around(tuned.values, vary)),
        cross_validation=_cross(held, trials.names, objective, seed),
    )
    if target is not None:
        target.write(json.dumps(result.to_json(), indent=1) + "\n")
    return result


def _errors(
    tuning: Tuning, names: Sequence[str], default: Mapping[str, float], tuned: Mapping[str, float]
) -> tuple[TuneErrors, tuple[TuneTrial, ...]]:
    """What the errors were, over all trials and of each."""
    before, after = (tuning.scores(values, range(len(names))) for values in (default, tuned))
    each = tuple(
        TuneTrial(name, _figures(b), _figures(a))
        for name, b, a in zip(names, before, after, strict=True)
    )
    return TuneErrors(_figures(means(before)), _figures(means(after))), each


def _moved(
    tuning: Tuning, before: Mapping[str, float], tuned: Mapping[str, float]
) -> tuple[TunedParameter, ...]:
    """What moved, from where to where."""
    values = (before, tuning.start, tuned)
    return tuple(
        TunedParameter(p.name, p.unit, p.low, p.high, *(v[p.name] for v in values))
        for p in tuning.params
    )


def _search(tuning: Tuning, tuned: Tuned, detune: float) -> TuneSearch:
    """How it was searched."""
    return TuneSearch(
        method="pattern search (Hooke and Jeeves) in the logarithm",
        rounds=len(tuned.history) - 1,
        rounds_most=tuning.rounds,
        detune=detune,
        evaluations=tuned.evaluations,
        start=_or_none(tuned.start),
        history=tuple(_or_none(h) for h in tuned.history),
    )


def _check_numbers(
    *, word: int, folds: int | None, rounds: int, jobs: int | None, seed: int | None
) -> None:
    check_word(word)
    check_optional("folds", folds, 1)
    check_number("rounds", rounds, 0)
    check_optional("jobs", jobs, 1, JOBS_MOST)
    check_optional("seed", seed, 0)


def _check_factors(**factors: float) -> None:
    for name, factor in factors.items():
        if not 1.0 <= factor <= 1000.0:
            raise InputError.at(
                name,
                wanted="1 to 1000",
                found=f"{factor:g}",
                fix="choose a factor inside the range",
            )


def _cross(
    held: Sequence[Fold], labels: Sequence[str], objective: Objective, seed: int | None
) -> CrossValidation | None:
    """What the folds say; None without any."""
    if not held:
        return None
    every = [s for f in held for s in f.scores]
    return CrossValidation(
        folds=tuple(
            TuneFold(
                test=tuple(dict.fromkeys(labels[i] for i in f.test)),
                train=tuple(dict.fromkeys(labels[i] for i in f.train)),
                train_figure=_or_none(f.tuned.best),
                test_figure=_or_none(objective.value(f.scores)),
                test_error=_figures(means(f.scores)),
                parameters=f.tuned.values,
            )
            for f in held
        ),
        seed=seed,
        mean_test_figure=_or_none(objective.value(every)),
        mean_test_error=_figures(means(every)),
        source="mean over all trials, each with parameters tuned on the other folds",
    )


def _figures(score: Mapping[str, float]) -> dict[str, float | None]:
    return {n: _or_none(v) for n, v in score.items()}


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def call(arguments: Arguments) -> Outcome:
    """Tune, and say where the result is."""
    file = arguments.typed.get("output")
    return outcome(arguments.call(tune), "" if file is None else f"\n  written: {file}")


VERB = Verb(tune, call=call)
