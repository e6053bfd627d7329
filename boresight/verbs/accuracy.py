"""Measure errors against the truth of logs, beside published filters.

boresight accuracy  # the attitude filters and VQF on the bundled logs
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder --json > accuracy.json  # ours beside VQF
boresight accuracy mekf flight.ulg --align heading  # without a constant offset of the heading
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from boresight import options
from boresight.model.errors import require, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, offered, split_names
from boresight.model.tools.external import optional
from boresight.model.words.fixed import check_word
from boresight.sim.accuracy import runs
from boresight.sim.accuracy.figures import ALIGNMENTS, gives_attitude, means
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.result import Figure, Result, Row

GROUPS = (options.rows, options.profiles, options.judged)

#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"

#: Figures that can be compared with an earlier result (`sim.result.baseline`).
JUDGED = {
    "word": Figure("word", "same"),
    "parameters.*.*": Figure("value", "parameter"),
    "estimators.*.mean.*": Figure("error from the truth, mean", "truth"),
    "estimators.*.trials.*.error.*": Figure("error from the truth", "truth"),
    "estimators.*.vs_float.*.apart": Figure("fixed point from float64", "rounding"),
    "estimators.*.saturated_updates": Figure("updates that saturated", "count"),
}


def accuracy(
    names: options.EstimatorNames = FIRST,
    /,
    *logs: options.Logs,
    align: str = "none",
    params: options.Params = None,
    word: options.Word = 32,
    jobs: options.Jobs = None,
    progress: options.Progress = None,
) -> Result:
    """Measure the error of each output against the truth of logs, and against float64.

    Returns ``estimators``: each as the emitted C, whose words are those of the core (fixed), in
    compiled float64, or as its package: ``mean`` errors over the logs with truth, ``units``,
    ``vs_float``, ``saturated_updates``, ``saturations`` by value, and ``trials``, the
    errors on each log. Good if fixed point is within the tolerances of float64. Raises InputError
    for bad logs, unknown names and illegal parameters; ToolMissing if the package of a named
    published filter is not installed.

    Parameters
    ----------
    names : Named or several
        Estimators and published attitude filters with commas, or ours, published, all of them.
    logs : paths, or data in memory
        Logs, or folders of logs; the bundled ones by default. Data in memory is what `Record.of`
        takes, with truths as ``NAME_true``.
    align : str
        Constant offset that is removed from attitudes first, and printed: none, heading (about
        the vertical) or full.
    params : mapping, optional
        Parameter values by estimator.
    """
    say = progress or (lambda text: None)
    named, peers = chosen(names)
    ours = [estimator_of(n) for n in named]
    check_word(word)
    require_choice("align", align, ALIGNMENTS)
    require_whole("jobs", jobs, 1)
    missing = peers if names == FIRST and not find_spec("vqf") else []
    peers = [] if missing else peers
    if peers:
        optional("vqf")
    wanted, fix = "an estimator with parameters", "name an estimator, or leave the values out"
    require(bool(ours) or not params, "parameters", wanted, "published filters only", fix)
    values = dict(zip((e.name for e in ours), options.params_of_each(ours, params), strict=True))
    for e in [] if logs and align == "none" else ours:
        where, fix = "logs", "name one after the estimator; the bundled ones are of attitudes"
        where, fix = ("--align", "leave --align out") if logs else (where, fix)
        wanted, found = "attitudes, outputs qw qx qy qz", f"{e.name}, which has none"
        require(gives_attitude(e), where, wanted, found, fix)
    if not logs:
        say("no log named: the bundled ones")
    trials, notes = runs.read_trials(logs, ours, load=bool(peers))
    by_name: dict[str, list[list[runs.Scores]]] = {}
    for name, some in values.items():
        members = [trial.feeds[name] for trial in trials]
        both = runs.LogRuns(members, floating=True, word=word, jobs=jobs, align=align)
        by_name[name] = both.run(some)
        pairs = zip(trials, by_name[name], strict=True)
        notes += [f"{trial.name}: {name}, {t}" for trial, (of, *_) in pairs for t in of.notes]
        say(name)
    for name in peers:
        by_name[name] = [[runs.published(name, trial.log.first, align)] for trial in trials]
        say(name)
    rows = [
        _row(name, trials, of_level)
        for name, of in by_name.items()
        for of_level in zip(*of, strict=True)
    ]
    data = {
        "word": word,
        "align": align,
        "logs": [_log(trial) for trial in trials],
        "parameters": {e.name: e.param_values(values[e.name]) for e in ours},
        "estimators": rows,
    }
    saturated = [
        f"{row['estimator']}: {saturated_text(row['saturated_updates'], row['saturations'])}"
        for row in rows
        if row["saturated_updates"]
    ]
    failures = [
        f"{row['estimator']}: fixed point against float64: {near['output']} beyond its tolerance"
        for row in rows
        for near in row["vs_float"]
        if not near["good"]
    ]
    notes = [*saturated, *notes, *(f"{n} left out: its package vqf is missing" for n in missing)]
    return Result(data, _tables(rows, trials), "", notes, failures, JUDGED)


def chosen(names: Named | Sequence[Named]) -> tuple[list[Named], list[str]]:
    """Split names into estimators and published filters.

    A text holds one or several names with commas; "ours" are the estimators with the inputs of the
    published filters, "published" these, "all" both. InputError: an estimator twice, or nothing.
    """
    installed = offered(Estimator, "estimator", ESTIMATOR_GROUP)
    ours = [name for name, kind in installed.items() if kind.inputs == INPUTS]
    peers = [*runs.PEERS]
    words: dict[str, list[Any]] = {"ours": ours, "published": peers, "all": [*ours, *peers]}
    several = [names] if isinstance(names, str | Estimator | type) else names
    texts = [t for n in several for t in (split_names(n) if isinstance(n, str) else [n])]
    members = [m for t in texts for m in (words.get(t, [t]) if isinstance(t, str) else [t])]
    fix = f"name some, or one of {', '.join(words)}"
    require(bool(members), "estimators", "at least one", None, fix)
    published = dict.fromkeys(n for n in members if isinstance(n, str) and n in peers)
    own = [n for n in members if not (isinstance(n, str) and n in published)]
    return options.estimator_names(*own), [*published]


def _log(trial: runs.Trial) -> dict[str, Any]:
    """A log; its rate is the median, of a long file over the first 65,536 rows."""
    first, timed = trial.log.first, {"t", "dt"} & {*trial.log.first.columns}
    return {
        "trial": trial.name,
        "samples": len(trial.log),
        "rate_hz": round(1.0 / float(np.median(first.steps())), 3) if timed else None,
        "reference": trial.reference,
    }


def _row(name: str, trials: Sequence[runs.Trial], every: Sequence[runs.Scores]) -> dict[str, Any]:
    """One estimator at one level: means over the logs with truth, and each log."""
    saturated = [of.saturated for of in every if of.saturated is not None]
    scores = [*zip(trials, every, strict=True)]
    return {
        "estimator": name,
        "level": every[0].level,
        "kind": "peer" if every[0].level == "package" else "ours",
        "units": {n: unit for of in every for n, unit in of.units.items()},
        "mean": means(of.errors for trial, of in scores if trial.reference == "truth"),
        "vs_float": [_near(d) for d in zip(*(of.near for of in every), strict=True)],
        "saturated_updates": sum(saturated) if saturated else None,
        "saturations": dict(sum((Counter(of.saturations) for of in every), Counter[str]())),
        "trials": [
            {
                "trial": trial.name,
                "error": dict(of.errors),
                "vs_float": {d.output: _apart(d) for d in of.near},
                "saturated_updates": of.saturated,
                "offset_deg": list(of.offset_deg),
            }
            for trial, of in scores
        ],
    }


def _apart(difference: Difference) -> float:
    """Largest difference; of words how many differ."""
    decided = difference.decided
    return float(difference.largest if decided is None else decided.differing)


def _near(several: Sequence[Difference]) -> dict[str, Any]:
    first, apart = several[0], [_apart(d) for d in several]
    return {
        "output": first.output,
        "unit": first.unit,
        "apart": sum(apart) if first.unit == "words" else max(apart),
        "tolerance": first.tolerance,
        "good": all(d.good for d in several),
    }


def _tables(rows: Sequence[Row], trials: Sequence[runs.Trial]) -> dict[str, list[Row]]:
    """Means of each estimator, and the main error of each on every log."""
    summary: list[Row] = [
        {
            "estimator": row["estimator"],
            "level": row["level"],
            **{f"{n} {row['units'][n]}".rstrip(): value for n, value in row["mean"].items()},
            "from float64, over tolerance": max(
                (d["apart"] / d["tolerance"] for d in row["vs_float"] if d["tolerance"]),
                default=None,
            ),
            "saturated": row["saturated_updates"],
        }
        for row in rows
    ]
    logs: list[Row] = [
        {"log": trial.name, "reference": trial.reference}
        | {
            f"{row['estimator']} {name} {unit}".rstrip(): row["trials"][k]["error"].get(name)
            for row in rows
            if row["level"] != "float"
            for name, unit in list(row["units"].items())[:1]
        }
        for k, trial in enumerate(trials)
    ]
    return {"errors, mean over the logs with truth": summary, "error on each log": logs}
