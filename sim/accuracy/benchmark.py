"""Every estimator on every log: fixed point, float64, and published attitude filters.

Fixed point is the emitted C, whose words are those of the core; float is the compiled float64.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from boresight.model.estimator import Estimator
from boresight.sim.accuracy.figures import ANGLES, Alignment, attitude_errors, means
from boresight.sim.accuracy.peers import run_peer
from boresight.sim.accuracy.runs import LogRuns, Scores, Trial
from boresight.sim.baseline import Figure
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.verdict import saturated_text
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.result import Result, Row

#: Figures that can be compared with an earlier result (`sim.baseline`).
JUDGED = {
    "word": Figure("word", "same"),
    "parameters.*.*": Figure("value", "parameter"),
    "estimators.*.mean.*": Figure("error from the truth, mean", "truth"),
    "estimators.*.trials.*.error.*": Figure("error from the truth", "truth"),
    "estimators.*.vs_float.*.apart": Figure("fixed point from float64", "rounding"),
    "estimators.*.saturated_updates": Figure("updates that saturated", "count"),
}
_SOURCE = (
    "root mean square error against truth, of attitudes in degrees by the method of the BROAD "
    "benchmark (doi 10.3390/data6070072); means over the logs with truth; fixed point is the "
    "emitted C, whose words are the core's"
)


def benchmark(
    estimators: Sequence[Estimator],
    peers: Sequence[str],
    trials: Sequence[Trial],
    *,
    params: Mapping[str, Mapping[str, float]],
    word: int,
    align: str,
    jobs: int | None,
    say: Callable[[str], None],
) -> Result:
    """Run everything.

    ``peers`` are keys of `sim.accuracy.peers.PEERS`, ``params`` parameter values by estimator,
    ``align`` is one of `ALIGNMENTS`; ``jobs`` are threads.

    Returns
    -------
    Result
        ``estimators``: for each at each level ``mean`` errors over the logs with truth, ``units``,
        ``vs_float``, ``saturated_updates``, ``saturations`` by value, ``seconds``, and ``trials``
        with the errors of each log. Good if fixed point is as near to float64 as the tolerances
        accept.

    Raises
    ------
    InputError
        An illegal parameter, or a log that a published filter does not take.
    """
    by_name: dict[str, list[list[Scores]]] = {}
    for name in (e.name for e in estimators):
        members = [trial.feeds[name] for trial in trials]
        runs = LogRuns(members, floating=True, word=word, jobs=jobs, align=align)
        by_name[name] = runs.run(params.get(name))
        say(name)
    for name in peers:
        by_name[name] = [[_published(name, trial.log.first, align)] for trial in trials]
        say(name)
    rows = [
        _row(name, [*zip(trials, of_level, strict=True)])
        for name, of in by_name.items()
        for of_level in zip(*of, strict=True)
    ]
    failures = [
        f"{row['estimator']}: fixed point against float64: {near['output']} beyond its tolerance"
        for row in rows
        for near in row["vs_float"]
        if not near["good"]
    ]
    data = {
        "source": _SOURCE,
        "word": word,
        "align": align,
        "logs": [_log(trial) for trial in trials],
        "parameters": {e.name: e.param_values(params.get(e.name)) for e in estimators},
        "estimators": rows,
    }
    notes = [
        f"{row['estimator']}: {saturated_text(row['saturated_updates'], row['saturations'])}"
        for row in rows
        if row["saturated_updates"]
    ]
    return Result(data, _tables(rows, trials), notes=notes, failures=failures, judged=JUDGED)


def _published(name: str, record: Record, align: str) -> Scores:
    """A published filter on a log."""
    log, start = NineAxis.of(record), time.perf_counter()
    q = run_peer(name, record)
    seconds = time.perf_counter() - start
    offset = Alignment(align)
    offset.add(q, log.attitude, log.counts)
    errors = attitude_errors(offset.turned(q), log.attitude, log.counts)
    units = dict.fromkeys(ANGLES, "deg")
    return Scores("package", errors, units, seconds, offset_deg=offset.offset_deg)


def _log(trial: Trial) -> dict[str, Any]:
    """A log; its rate is the median, of a long file over the first 65,536 rows."""
    first, timed = trial.log.first, {"t", "dt"} & {*trial.log.first.columns}
    return {
        "trial": trial.name,
        "samples": len(trial.log),
        "rate_hz": round(1.0 / float(np.median(first.steps())), 3) if timed else None,
        "reference": trial.reference,
    }


def _row(name: str, scores: Sequence[tuple[Trial, Scores]]) -> dict[str, Any]:
    """One estimator at one level: means over the logs with truth, and each log."""
    every = [of for _, of in scores]
    saturated = [of.saturated for of in every if of.saturated is not None]
    return {
        "estimator": name,
        "level": every[0].level,
        "kind": "peer" if every[0].level == "package" else "ours",
        "units": {n: unit for of in every for n, unit in of.units.items()},
        "mean": means(of.errors for trial, of in scores if trial.reference == "truth"),
        "vs_float": [_near(d) for d in zip(*(of.near for of in every), strict=True)],
        "saturated_updates": sum(saturated) if saturated else None,
        "saturations": dict(sum((Counter(of.saturations) for of in every), Counter[str]())),
        "seconds": round(sum(of.seconds for of in every), 3),
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
    """An output of fixed point beside float64 over all logs."""
    first, apart = several[0], [_apart(d) for d in several]
    return {
        "output": first.output,
        "unit": first.unit,
        "apart": sum(apart) if first.unit == "words" else max(apart),
        "tolerance": first.tolerance,
        "good": all(d.good for d in several),
    }


def _tables(rows: Sequence[Mapping[str, Any]], trials: Sequence[Trial]) -> dict[str, list[Row]]:
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
            "seconds": row["seconds"],
        }
        for row in rows
    ]
    logs: list[Row] = [
        {"log": trial.name, "reference": trial.reference}
        | {
            row["estimator"]: row["trials"][k]["error"].get(next(iter(row["units"])))
            for row in rows
            if row["level"] != "float" and row["units"]
        }
        for k, trial in enumerate(trials)
    ]
    return {"errors, mean over the logs with truth": summary, "error on each log": logs}
