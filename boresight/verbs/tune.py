"""`boresight tune`: fit an estimator's parameters to a folder of logs with truth, in the open."""

from __future__ import annotations

import json
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.arguments import JOBS_MOST, check_number, check_word
from boresight.disk.output import OutputFile
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, number_options, params_of, progress_of
from boresight.sim.accuracy.scoring import Scorer, has_truth
from boresight.sim.accuracy.tuning import (
    Fold,
    Tuned,
    deal_folds,
    pattern_search,
    sensitivities,
    tunable,
)
from boresight.sim.attitude.accuracy import AttitudeRmse
from boresight.sim.attitude.log import read_log
from boresight.sim.records.bundled import is_comparison
from boresight.verbs.check import log_files

__all__ = ["add_arguments", "call", "tune", "tuning_text"]

#: What the figures are, for people.
SOURCE = (
    "mean over trials of the orientation RMSE [deg], C model (same words as the core), "
    "BROAD's method"
)


def _figures(scores: Sequence[AttitudeRmse]) -> dict[str, float | None]:
    mean = np.mean(np.array(scores), axis=0)
    return {
        k: float(v) if np.isfinite(v) else None
        for k, v in zip(AttitudeRmse._fields, mean, strict=True)
    }


def _detuned(
    start: Mapping[str, float],
    names: Sequence[str],
    factor: float,
    legal: Mapping[str, tuple[float, float]],
) -> dict[str, float]:
    """The start with its parameters times and over a factor in turn, in their legal range."""
    out = dict(start)
    for k, name in enumerate(names):
        low, high = legal[name]
        out[name] = min(max(out[name] * (factor if k % 2 else 1.0 / factor), low), high)
    return out


def tune(
    name: Named,
    *logs: str | Path,
    folds: int = 3,
    seed: int | None = None,
    names: Sequence[str] | None = None,
    rounds: int = 12,
    detune: float = 1.0,
    params: Mapping[str, float] | None = None,
    word: int = 32,
    jobs: int | None = None,
    output: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Tune parameters by a pattern search on the C model; see `sim.accuracy.tuning`.

    Parameters
    ----------
    name : str
        Estimator.
    logs : paths
        Logs, or folders of logs. Those without truth are named and left out.
    folds : int
        Of the cross-validation; 1: none.
    seed : int, optional
        Shuffle the trials before they are dealt to the folds; by default in order of their names.
    names : sequence of str, optional
        Parameters to tune; all that can be moved by factors by default.
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
    dict
        ``parameters``, ``rmse_deg`` before and after, ``trials``, ``sensitivity``,
        ``cross_validation`` and how it was done.

    Raises
    ------
    InputError
        Unknown names, bad logs, no trial with truth, illegal numbers.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    given = estimator.param_values(params)
    tuned_params = tunable(estimator, given, names)
    check_word(word)
    check_number("folds", folds, 1)
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
    files = log_files(logs)
    target = None if output is None else OutputFile(output, "tune", of=estimator.name, inputs=files)
    read = sorted(((read_log(p), is_comparison(p)) for p in files), key=lambda pair: pair[0].name)
    trials = [log for log, other in read if has_truth(log) and not other]
    if not trials:
        raise InputError.at(
            "logs",
            wanted="at least one log with a reference attitude",
            found="none",
            fix="name logs with truth",
        )
    tests = deal_folds(len(trials), folds, seed) if folds != 1 else []
    say(f"{name}: {len(trials)} trials, {sum(map(len, trials)):,} samples; C model")
    scorer = Scorer(estimator, trials, word=word, jobs=jobs)
    moving = [p.name for p in tuned_params]
    start = _detuned(given, moving, detune, {p.name: (p.low, p.high) for p in tuned_params})
    memory: dict[tuple[tuple[str, float], ...], dict[int, AttitudeRmse]] = {}

    def scores(values: Mapping[str, float], which: Sequence[int]) -> list[AttitudeRmse]:
        """Scores of trials; none is run twice with the same values."""
        known = memory.setdefault(tuple(sorted(values.items())), {})
        missing = [k for k in which if k not in known]
        known.update(zip(missing, scorer.scores(values, missing), strict=True))
        return [known[k] for k in which]

    def search(which: Sequence[int], what: str) -> Tuned:
        begun = time.perf_counter()
        found = pattern_search(
            lambda values: float(np.mean([s.total for s in scores({**start, **values}, which)])),
            tuned_params,
            start,
            rounds=rounds,
            progress=lambda text: say(f"{what}, {text}"),
        )
        say(
            f"{what}: {found.start_deg:.4f} to {found.best_deg:.4f} deg, "
            f"{time.perf_counter() - begun:.1f} s"
        )
        return found

    every = range(len(trials))
    tuned = search(every, "all trials")
    held = []
    for k, test in enumerate(tests):
        train = tuple(i for i in every if i not in test)
        fold = search(train, f"fold {k + 1} of {folds}")
        outside = tuple(s.total for s in scores({**start, **fold.values}, test))
        held.append(Fold(test, train, fold, outside))
        say(
            f"fold {k + 1} of {folds}: {held[-1].mean_test_deg:.4f} deg on its "
            f"{len(test)} test trials"
        )
    values = {**start, **tuned.values}
    say("sensitivities")
    around = sensitivities(
        lambda v: float(np.mean([s.total for s in scores({**values, **v}, every)])),
        tuned_params,
        tuned.values,
    )
    before, after = scores(given, every), scores(values, every)
    labels = [log.name for log in trials]
    data: dict[str, Any] = {
        "estimator": estimator.name,
        "parameters": values,
        "word": word,
        "source": SOURCE,
        "rmse_deg": {"given": _figures(before), "tuned": _figures(after)},
        "tuned_parameters": [
            {
                "name": p.name,
                "unit": p.unit,
                "low": p.low,
                "high": p.high,
                "given": given[p.name],
                "start": start[p.name],
                "tuned": tuned.values[p.name],
            }
            for p in tuned_params
        ],
        "search": {
            "method": "pattern search (Hooke and Jeeves) in the logarithm",
            "rounds": len(tuned.history) - 1,
            "rounds_most": rounds,
            "detune": detune,
            "evaluations": tuned.evaluations,
            "start_deg": _or_none(tuned.start_deg),
            "history_deg": [_or_none(h) for h in tuned.history],
        },
        "trials": [
            {"trial": label, "given": a._asdict(), "tuned": b._asdict()}
            for label, a, b in zip(labels, before, after, strict=True)
        ],
        "without_truth": [log.name for log, other in read if other or not has_truth(log)],
        "sensitivity": [s.to_json() for s in around],
        "cross_validation": None
        if not held
        else {
            "folds": [
                {
                    "test": [labels[i] for i in f.test],
                    "train": [labels[i] for i in f.train],
                    "train_deg": _or_none(f.tuned.best_deg),
                    "test_deg": _or_none(f.mean_test_deg),
                    "parameters": f.tuned.values,
                }
                for f in held
            ],
            "seed": seed,
            "mean_test_deg": _or_none(float(np.mean([d for f in held for d in f.test_deg]))),
            "source": "mean over all trials, each with parameters tuned on the other folds",
        },
    }
    if target is not None:
        target.write(json.dumps(data, indent=1) + "\n")
    return data


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _deg(value: float | None) -> str:
    return "     -" if value is None else f"{value:6.3f}"


def tuning_text(data: Mapping[str, Any]) -> str:
    """The result as text for people."""
    given, tuned = data["rmse_deg"]["given"], data["rmse_deg"]["tuned"]
    width = max(len(p["name"]) for p in data["tuned_parameters"])
    lines = [
        f"{data['estimator']}, W = {data['word']}, {len(data['trials'])} trials: mean RMSE "
        "in degrees, total / heading / inclination",
        "  as given  " + " / ".join(_deg(given[k]) for k in AttitudeRmse._fields),
        "  tuned     "
        + " / ".join(_deg(tuned[k]) for k in AttitudeRmse._fields)
        + f"   ({data['search']['evaluations']} evaluations)",
    ]
    cross = data["cross_validation"]
    if cross is not None:
        lines += [
            f"  fold {k + 1}: trained on {len(f['train'])} {_deg(f['train_deg'])}, "
            f"tested on {len(f['test'])} {_deg(f['test_deg'])}"
            for k, f in enumerate(cross["folds"])
        ]
        lines.append(f"  cross-validated, mean over all trials {_deg(cross['mean_test_deg'])}")
    lines.append(f"  {'parameter':{width}s}  {'given':>10s} {'tuned':>10s}  total with x 0.5, x 2")
    for p, s in zip(data["tuned_parameters"], data["sensitivity"], strict=True):
        lines.append(
            f"  {p['name']:{width}s}  {p['given']:10.4g} {p['tuned']:10.4g}  "
            f"{_deg(s['half_deg'])} {_deg(s['double_deg'])}  {p['unit']}".rstrip()
        )
    if data["without_truth"]:
        lines.append("  left out, no truth: " + ", ".join(data["without_truth"]))
    return "\n".join(lines)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    parser.add_argument("--folds", type=int, default=3, help="of the cross-validation; 1: none")
    parser.add_argument(
        "--seed", type=int, help="shuffle the trials before they are dealt to folds"
    )
    parser.add_argument("--only", metavar="A,B,...", help="parameters to tune; default: all")
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
    data = tune(
        args.estimator,
        *args.logs,
        folds=args.folds,
        seed=args.seed,
        names=None if args.only is None else args.only.split(","),
        rounds=args.rounds,
        detune=args.detune,
        params=params_of(args, [args.estimator]),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=progress_of(args),
    )
    text = tuning_text(data)
    return 0, data, text if args.output is None else f"{text}\n  written: {args.output}"
