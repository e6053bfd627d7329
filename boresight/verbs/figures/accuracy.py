"""Error of our estimators and of published ones on logs with truth.

boresight accuracy  # at a glance: our filters, VQF, carriers that never rest
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder -o build  # ours beside VQF, Madgwick, Mahony, an EKF
boresight accuracy mekf,vqf_online folder --protocol full  # cut, biased, blinded, ...
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from boresight.arguments import JOBS_MOST, check_number, check_word
from boresight.disk.output import output_folder
from boresight.filters import chosen, params_by_estimator
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, estimator_of
from boresight.options import Arguments, Jobs, Option, Outcome, Params, Verb, Word, outcome
from boresight.results.accuracy import (
    AccuracyLog,
    AccuracyNear,
    AccuracyResult,
    AccuracyRow,
    AccuracyTrial,
)
from boresight.sim.accuracy.benchmark import Result, Trial, benchmark
from boresight.sim.accuracy.benchmark_page import render_page
from boresight.sim.accuracy.figures import ANGLES, units_of
from boresight.sim.accuracy.peers import PEERS, require_peers, run_peer
from boresight.sim.accuracy.tuning import means
from boresight.sim.compare.difference import Difference
from boresight.sim.records.bundled import bundled, bundled_names, is_comparison
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import log_files, read_logs
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.verbs.figures.protocol import accuracy_protocol

__all__ = ["accuracy", "read_trials"]

SOURCE = (
    "root mean square error against truth, of attitudes in degrees by the method of the BROAD "
    "benchmark (doi 10.3390/data6070072), over the samples that count; means over the trials with "
    "truth; fixed point is the emitted C, whose words are the core's"
)
#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"
#: Peer whose estimate stands in where a log has no reference.
STAND_IN = "vqf_offline"


def read_trials(
    logs: Sequence[Any],
    estimators: Sequence[Estimator],
    *,
    comparisons: Collection[str] = (),
    peers: bool = False,
) -> tuple[list[Trial], list[str]]:
    """Trials of logs and folders (the bundled logs by default), and names of those left out.

    Parameters
    ----------
    logs : paths, or data in memory (`Record.of`).
    comparisons : names of logs whose reference is another device's estimate, not truth.
    peers : bool
        Whether published filters run: then logs without reference are measured against `STAND_IN`;
        without them they are left out.

    Raises
    ------
    InputError
        A bad log, two logs of one name, a name among ``comparisons`` that no log has.
    """
    trials: dict[str, Trial] = {}
    left_out: list[str] = []
    for record, path in read_logs(logs or [bundled(name) for name in bundled_names()]):
        if record.name in trials or record.name in left_out:
            raise InputError.at(
                record.where,
                wanted="logs of different names",
                found=record.name,
                fix="name each log once, or rename one",
            )
        other = (path is not None and is_comparison(path)) or record.name in comparisons
        trial = _trial(record, estimators, "comparison" if other else "truth", path, peers)
        if trial is None:
            left_out.append(record.name)
        else:
            trials[record.name] = trial
    for name in comparisons:
        if name not in trials or trials[name].reference != "comparison":
            raise InputError.at(
                "--comparison",
                wanted="names of logs with a reference",
                found=repr(name),
                fix="write the file's name without its suffix",
            )
    return sorted(trials.values(), key=lambda t: t.name), sorted(left_out)


def _trial(
    record: Record, estimators: Sequence[Estimator], reference: str, path: Path | None, peers: bool
) -> Trial | None:
    """A record as a trial; None where it has no truth and nothing stands in."""
    folder = "" if path is None else path.absolute().parent.name
    feeds = {e.name: feed(fitted(e, record), record) for e in estimators}
    if any(units_of(e, feeds[e.name]) for e in estimators):
        return Trial(record, reference, folder, feeds)
    if not peers:
        return None
    log = NineAxis.of(record)
    if log.q is not None and (np.isfinite(log.q).all(axis=1) & log.counts).any():
        return Trial(record, reference, folder, feeds)
    if not log.mag_new.any():
        return None
    record = replace(log, q=run_peer(PEERS[STAND_IN], record)).record()
    return Trial(record, STAND_IN, folder, {e.name: feed(e, record) for e in estimators})


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _plain(figures: Mapping[str, float]) -> dict[str, float | None]:
    return {n: _number(v) for n, v in figures.items()}


def _mean(results: Sequence[Result], trials: Collection[str]) -> dict[str, float | None] | None:
    """Plain mean over some trials; None if there is none."""
    found = means([r.errors for r in results if r.trial in trials])
    return _plain(found) if found else None


def _apart(d: Difference) -> float:
    """Largest difference; of words how many differ."""
    return float(round(d.rms**2 * d.samples)) if d.unit == "words" else d.largest


def _near(results: Sequence[Result]) -> tuple[AccuracyNear, ...]:
    """Fixed point against float64 over all records, output by output."""
    rows = []
    for several in zip(*(r.near for r in results), strict=True):
        found = [_apart(d) for d in several]
        rows.append(
            AccuracyNear(
                output=several[0].output,
                unit=several[0].unit,
                apart=_number(sum(found) if several[0].unit == "words" else max(found)),
                tolerance=several[0].tolerance,
                good=all(d.good for d in several),
            )
        )
    return tuple(rows)


def _rows(
    estimators: Sequence[Estimator], results: Sequence[Result], trials: Sequence[Trial]
) -> tuple[AccuracyRow, ...]:
    """A row for each estimator and level."""
    held: dict[tuple[str, str], list[Result]] = {}
    for r in results:
        held.setdefault((r.estimator, r.level), []).append(r)
    known: dict[str, Estimator] = {e.name: e for e in estimators}
    return tuple(_row(known.get(n, n), level, found, trials) for (n, level), found in held.items())


def _row(
    estimator: Estimator | str, level: str, results: Sequence[Result], trials: Sequence[Trial]
) -> AccuracyRow:
    """One estimator at one level: means, worst cases, and every trial."""
    folders: dict[str, list[str]] = {}
    for t in trials:
        if t.reference == "truth":
            folders.setdefault(t.folder, []).append(t.name)
    saturated = [r.saturated for r in results if r.saturated is not None]
    units = dict.fromkeys(ANGLES, "deg")
    if not isinstance(estimator, str):
        units = {n: u for t in trials for n, u in units_of(estimator, t.fed(estimator)).items()}
    return AccuracyRow(
        estimator=estimator if isinstance(estimator, str) else estimator.name,
        level=level,
        kind="peer" if level == "package" else "ours",
        summary=PEERS[estimator].summary if isinstance(estimator, str) else estimator.summary,
        attitude=ANGLES[0] in units,
        units=units,
        mean=_mean(results, [t for held in folders.values() for t in held]),
        mean_by_folder={folder: _mean(results, held) for folder, held in folders.items()},
        vs_float=_near(results),
        saturated_updates=sum(saturated) if saturated else None,
        seconds=round(sum(r.seconds for r in results), 3),
        trials=tuple(
            AccuracyTrial(
                r.trial,
                _plain(r.errors),
                {d.output: _number(_apart(d)) for d in r.near},
                r.saturated,
            )
            for r in results
        ),
    )


def _log_row(trial: Trial) -> AccuracyLog:
    timed = {"t", "dt"} & set(trial.record.columns)
    return AccuracyLog(
        trial=trial.name,
        samples=len(trial.record),
        rate_hz=round(1.0 / float(np.median(trial.record.steps())), 3) if timed else None,
        reference=trial.reference,
        folder=trial.folder,
    )


def accuracy(
    names: Named | Sequence[Named],
    *logs: Any,
    floating: Annotated[bool, Option(("--no-float",))] = True,
    comparisons: Annotated[Collection[str], Option(("--comparison",), "LOG,...")] = (),
    params: Params = None,
    word: Word = 32,
    jobs: Jobs = None,
    output: Annotated[str | Path | None, Option(("-o", "--output"), "DIR")] = None,
    progress: Callable[[str], None] | None = None,
) -> AccuracyResult:
    """Error of estimators against the truth of logs, output by output, and from float64.

    With more than one job and published filters, a script that calls this needs
    ``if __name__ == "__main__"``.

    Parameters
    ----------
    names : Named or several
        Estimators and published attitude filters, or ``ours``, ``published``, ``all`` of them;
        a text may hold several with commas.
    logs : paths, or data in memory
        Logs, or folders of logs; the bundled ones by default. Data in memory is what `Record.of`
        takes, with truths as ``NAME_true``.
    floating : bool
        Compiled float64 runs too, and fixed point is compared with it; --no-float: fixed point
        only.
    comparisons : names of logs
        Their reference is another device's estimate: shown, but no part of the means.
    params : mapping
        Values by estimator; files as tune writes them.
    output : path, optional
        Folder for accuracy.html and accuracy.json.

    Returns
    -------
    AccuracyResult
        Errors of every estimator at every level, over all logs and of each.

    Raises
    ------
    InputError
        Bad logs, unknown names, illegal parameters, a folder that cannot be written, a published
        filter whose package is not installed.
    """
    say = progress or (lambda text: None)
    named, peers = chosen(names)
    ours = [estimator_of(n) for n in named]
    check_word(word)
    check_number("jobs", 1 if jobs is None else jobs, 1, JOBS_MOST)
    if peers:
        require_peers([PEERS[name] for name in {*peers, STAND_IN}])
    for e in ours:
        e.param_values((params or {}).get(e.name))
    trials, left_out = read_trials(logs, ours, comparisons=comparisons, peers=bool(peers))
    if not trials:
        raise InputError.at(
            "logs",
            wanted="at least one log with a truth of an output, as NAME_true, or a reference "
            "attitude",
            found="none",
            fix="name logs with truth",
        )

    def work() -> AccuracyResult:
        if not logs:
            say("no log named: the bundled ones")
        numbers: dict[str, Any] = {"params": params, "word": word, "with_float": floating}
        results = benchmark(ours, peers, trials, **numbers, jobs=jobs, progress=progress)
        rows = _rows(ours, results, trials)
        return AccuracyResult(
            source=SOURCE,
            word=word,
            good=all(d.good for row in rows for d in row.vs_float),
            logs=tuple(_log_row(t) for t in trials),
            left_out=tuple(left_out),
            parameters={name: dict(values) for name, values in (params or {}).items()},
            estimators=rows,
        )

    if output is None:
        return work()
    made = ("accuracy.html", "accuracy.json")
    files = log_files(log for log in logs if isinstance(log, str | Path))
    with output_folder(output, "accuracy", files=made, inputs=files) as folder:
        result = work()
        data = result.to_json()
        (folder / "accuracy.json").write_text(json.dumps(data, indent=1) + "\n")
        (folder / "accuracy.html").write_text(render_page(data), encoding="utf-8")
    return result


def call(
    arguments: Arguments,
    names: Annotated[str | None, Option(metavar="ESTIMATOR[,ESTIMATOR...]")] = None,
    *logs: Annotated[Any, Option(metavar="LOG")],
    protocol: Annotated[str | None, Option(metavar="NAME")] = None,
) -> Outcome:
    """On logs as they are, or made harder by a protocol.

    Parameters
    ----------
    names : str, optional
        Estimators and published filters, or: ours, published, all; without anything a short
        protocol of ours and VQF, glance.
    logs : paths
        Logs, or folders of logs; by default the bundled logs.
    protocol : str, optional
        full, short or glance: each log cut, biased, resampled, blinded, ...; without logs the
        bundled ones and synthetic carriers.
    """
    typed = arguments.typed
    if names is None:
        names, protocol = FIRST, protocol or "glance"
    if protocol is not None:
        found = "a protocol, which runs float64 and needs truth"
        arguments.only(accuracy_protocol, wanted="logs alone", found=found)
    if "comparisons" in typed:
        typed["comparisons"] = ",".join(filter(None, typed["comparisons"].split(",")))
    params = params_by_estimator(chosen(names)[0], *arguments.params)
    if protocol is not None:
        result = arguments.call(accuracy_protocol, protocol, names, *logs, params=params)
        return outcome(result, f"\n\n{result.page}")
    result = arguments.call(accuracy, names, *logs, params=params)
    folder = typed.get("output")
    return outcome(result, "" if folder is None else f"\n\n{folder}/accuracy.html")


VERB = Verb(accuracy, accuracy_protocol, call=call)
