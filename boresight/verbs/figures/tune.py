"""`boresight tune`: fit an estimator's parameters to logs with truth, in the open."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.arguments import JOBS_MOST, check_number, check_word
from boresight.disk.output import OutputFile
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, number_options, params_of, progress_of
from boresight.parameters import parse_settings
from boresight.results.tune import (
    CrossValidation,
    TunedParameter,
    TuneErrors,
    TuneFold,
    TuneResult,
    TuneSearch,
    TuneTrial,
)
from boresight.sim.accuracy.figures import units_of
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.search import Tuned, deal_folds, tunable
from boresight.sim.accuracy.tuning import Fold, Objective, Tuning, detuned, means, weights_of
from boresight.sim.records.bundled import is_comparison
from boresight.sim.records.feed import Feed, feed
from boresight.verbs.check import log_files, read_logs

__all__ = ["add_arguments", "call", "tune"]

#: What the figures are, for people.
SOURCE = (
    "root mean square error against truth of the emitted C (the core's words), mean over the "
    "trials; of an attitude the angles, by BROAD's method, in deg"
)


def tune(
    name: Named,
    *logs: Any,
    folds: int | None = None,
    seed: int | None = None,
    names: Sequence[str] | None = None,
    weights: Mapping[str, float] | None = None,
    rounds: int = 12,
    detune: float = 1.0,
    params: Mapping[str, float] | None = None,
    word: int = 32,
    jobs: int | None = None,
    output: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> TuneResult:
    """Tune parameters by a pattern search on the emitted C; see `sim.accuracy.tuning`.

    Parameters
    ----------
    name : str, class or Estimator
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs. Those without truth are named and left out.
    folds : int, optional
        Of the cross-validation; 1: none. By default 3, or as many as there are trials.
    seed : int, optional
        Shuffle the trials before they are dealt to the folds; by default in order of their names.
    names : sequence of str, optional
        Parameters to tune; all that can be moved by factors by default.
    weights : mapping, optional
        Of figures (an output, or an angle of an attitude), on top of the defaults.
    rounds : int
        Most rounds of each search.
    detune : float
        Start from values off by this factor (over and times it, in turn): if the start itself was
        tuned on these trials, the folds do not inherit that.
    params : mapping, optional
        Values to start from, and to hold where they are not tuned; defaults otherwise.
    word : int
        Word width.
    jobs : int, optional
        Threads; one for each processor by default.
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
    given = estimator.param_values(params)
    moving = tunable(estimator, given, names)
    _check_numbers(word=word, folds=folds, rounds=rounds, jobs=jobs, seed=seed, detune=detune)
    files = log_files(log for log in logs if isinstance(log, str | Path))
    target = None if output is None else OutputFile(output, "tune", of=estimator.name, inputs=files)
    trials, left_out = _trials(estimator, logs)
    units = {n: u for t in trials for n, u in units_of(estimator, t).items()}
    chosen = weights_of(units, weights)
    count = min(3, len(trials)) if folds is None else folds
    tests = deal_folds(len(trials), count, seed) if count != 1 else []
    say(f"{estimator.name}: {len(trials)} trials, {sum(map(len, trials)):,} samples; C")
    scorer = Scorer(estimator, trials, word=word, jobs=jobs)
    objective = Objective.of(chosen, means(scorer.scores(given)))
    tuning = Tuning(scorer, moving, detuned(given, moving, detune), objective, rounds, say)
    tuned = tuning.search(range(len(trials)), "all trials")
    held = tuning.folds(tests)
    say("sensitivities")
    error, each = _errors(tuning, given, tuned.values)
    result = TuneResult(
        estimator=estimator.name,
        parameters={**tuning.start, **tuned.values},
        word=word,
        source=SOURCE,
        units=units,
        weights=chosen,
        error=error,
        trials=each,
        tuned_parameters=_moved(tuning, given, tuned.values),
        search=_search(tuning, tuned, detune),
        without_truth=tuple(left_out),
        sensitivity=tuple(tuning.around(tuned.values)),
        cross_validation=_cross(held, [t.record.name for t in trials], objective, seed),
    )
    if target is not None:
        target.write(json.dumps(result.to_json(), indent=1) + "\n")
    return result


def _errors(
    tuning: Tuning, given: Mapping[str, float], tuned: Mapping[str, float]
) -> tuple[TuneErrors, tuple[TuneTrial, ...]]:
    """What the errors were, over all trials and of each."""
    trials = tuning.scorer.feeds
    before, after = (tuning.scores(values, range(len(trials))) for values in (given, tuned))
    each = tuple(
        TuneTrial(t.record.name, _figures(b), _figures(a))
        for t, b, a in zip(trials, before, after, strict=True)
    )
    return TuneErrors(_figures(means(before)), _figures(means(after))), each


def _moved(
    tuning: Tuning, given: Mapping[str, float], tuned: Mapping[str, float]
) -> tuple[TunedParameter, ...]:
    """What moved, from where to where."""
    values = (given, tuning.start, tuned)
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
    *, word: int, folds: int | None, rounds: int, jobs: int | None, seed: int | None, detune: float
) -> None:
    check_word(word)
    check_number("folds", 1 if folds is None else folds, 1)
    check_number("rounds", rounds, 1)
    check_number("jobs", 1 if jobs is None else jobs, 1, JOBS_MOST)
    check_number("seed", 0 if seed is None else seed, 0)
    if not 1.0 <= detune <= 1000.0:
        raise InputError.at(
            "detune",
            wanted="1 to 1000",
            found=f"{detune:g}",
            fix="choose a factor inside the range",
        )


def _trials(estimator: Estimator, logs: Sequence[Any]) -> tuple[list[Feed], list[str]]:
    """Logs with truth in the order of their names, and the names of the others."""
    trials: list[Feed] = []
    left_out: list[str] = []
    for record, path in read_logs(logs):
        given = feed(estimator, record)
        if units_of(estimator, given) and not (path is not None and is_comparison(path)):
            trials.append(given)
        else:
            left_out.append(given.record.name)
    if not trials:
        raise InputError.at(
            "logs",
            wanted=f"at least one log with a truth of {estimator.name}'s outputs, as "
            f"{estimator.outputs[0].name}_true",
            found="none",
            fix="name logs with truth",
        )
    return sorted(trials, key=lambda t: t.record.name), sorted(left_out)


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
                test=tuple(labels[i] for i in f.test),
                train=tuple(labels[i] for i in f.train),
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


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    parser.add_argument("--folds", type=int, help="of the cross-validation, default 3; 1: none")
    parser.add_argument(
        "--seed", type=int, help="shuffle the trials before they are dealt to folds"
    )
    parser.add_argument("--only", metavar="A,B,...", help="parameters to tune; default: all")
    parser.add_argument(
        "--weight",
        action="append",
        default=[],
        metavar="OUTPUT=NUMBER",
        help="how much an output's error counts, repeatable; default 1, of an attitude its angle",
    )
    parser.add_argument("--rounds", type=int, default=12, help="most rounds of a search")
    parser.add_argument(
        "--detune",
        type=float,
        default=1.0,
        metavar="FACTOR",
        help="start off by this factor, so that folds do not inherit the start",
    )
    parser.add_argument("--jobs", type=int, help="threads; default: one for each processor")
    number_options(parser)
    parser.add_argument("-o", "--output", metavar="PARAMS.json", help="result, for --params")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    result = tune(
        args.estimator,
        *args.logs,
        folds=args.folds,
        seed=args.seed,
        names=None if args.only is None else args.only.split(","),
        weights=parse_settings(args.weight, "--weight"),
        rounds=args.rounds,
        detune=args.detune,
        params=params_of(args, [args.estimator]),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=progress_of(args),
    )
    text = str(result)
    if args.output is not None:
        text += f"\n  written: {args.output}"
    return 0, result.to_json(), text
