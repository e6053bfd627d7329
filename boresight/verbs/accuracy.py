"""`boresight accuracy`: our estimators and the published ones on logs with truth."""

from __future__ import annotations

import json
import math
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from boresight.arguments import JOBS_MOST, check_number, check_word
from boresight.disk.output import output_folder
from boresight.model.errors import InputError
from boresight.model.estimators import ESTIMATORS
from boresight.options import Outcome, number_options, progress_of
from boresight.parameters import values_for
from boresight.sharing import params_for_each
from boresight.sim.accuracy.benchmark import Result, Trial, benchmark
from boresight.sim.accuracy.benchmark_page import render_page
from boresight.sim.accuracy.peers import PEERS, require_peers, run_peer
from boresight.sim.accuracy.scoring import has_truth
from boresight.sim.attitude.accuracy import AttitudeRmse
from boresight.sim.attitude.log import read_log
from boresight.sim.records.bundled import bundled, bundled_names, is_comparison
from boresight.verbs.check import log_files

__all__ = [
    "accuracy",
    "accuracy_text",
    "add_arguments",
    "call",
    "params_by_estimator",
    "read_trials",
]

SOURCE = (
    "RMSE in degrees by the method of the BROAD benchmark (doi 10.3390/data6070072) over "
    "the samples that move and have a reference; means over the trials with truth; fixed "
    "point is the C model, whose words are the core's"
)
#: Peer whose estimate stands in where a log has no reference.
STAND_IN = "vqf_offline"


def read_trials(
    paths: Sequence[str | Path], *, comparisons: Collection[str] = (), stand_in: bool = True
) -> tuple[list[Trial], list[str]]:
    """Trials of logs and folders (the bundled logs by default), and names of those left out.

    Parameters
    ----------
    comparisons : names of logs whose reference is another device's estimate, not truth.
    stand_in : bool
        Measure logs without reference against `STAND_IN`; otherwise leave them out.

    Raises
    ------
    InputError
        A bad log, two logs of one name, a name among ``comparisons`` that no log has.
    """
    files = log_files(paths) if paths else [bundled(name) for name in bundled_names()]
    trials: dict[str, Trial] = {}
    left_out = []
    for path in files:
        log = read_log(path)
        if log.name in trials or log.name in left_out:
            raise InputError.at(
                str(path),
                wanted="logs of different names",
                found=log.name,
                fix="name each log once, or rename one",
            )
        if log.q is not None and has_truth(log):
            other = is_comparison(path) or log.name in comparisons
            trials[log.name] = Trial(
                log, "comparison" if other else "truth", log.q, path.absolute().parent.name
            )
        elif stand_in and log.mag_new.any():
            trials[log.name] = Trial(
                log, STAND_IN, run_peer(PEERS[STAND_IN], log), path.absolute().parent.name
            )
        else:
            left_out.append(log.name)
    for name in comparisons:
        if name not in trials or trials[name].reference != "comparison":
            raise InputError.at(
                "--comparison",
                wanted="names of logs with a reference",
                found=repr(name),
                fix="write the file's name without its suffix",
            )
    return sorted(trials.values(), key=lambda t: t.log.name), sorted(left_out)


def params_by_estimator(
    names: Sequence[str], files: Sequence[str | Path] = (), settings: Sequence[str] = ()
) -> dict[str, dict[str, float]]:
    """Parameter values by estimator, of files and ``[ESTIMATOR.]NAME=NUMBER`` texts.

    A file that names its estimator is for that one; values of nobody need a single estimator.

    Raises
    ------
    InputError
        Values whose estimator is unknown or not among ``names``.
    """
    if (files or settings) and not names:
        raise InputError.at(
            "parameters",
            wanted="estimators of ours",
            found="none of them",
            fix="choose one with --estimators, or leave the values out",
        )
    if len(names) != 1:
        return params_for_each(names, files, settings)
    values = values_for(names[0], files, settings)
    return {names[0]: values} if values else {}


def _chosen(estimators: Sequence[str] | None, with_peers: bool) -> tuple[list[str], list[str]]:
    """Ours and peers of a choice; all by default."""
    known = [*ESTIMATORS, *PEERS]
    chosen = known if estimators is None else list(dict.fromkeys(estimators))
    for name in chosen:
        if name not in known:
            raise InputError.at(
                "--estimators",
                wanted=f"some of {', '.join(known)}",
                found=repr(name),
                fix="separate them with commas",
            )
    peers = [n for n in chosen if n in PEERS and with_peers]
    if estimators is not None and not with_peers and any(n in PEERS for n in chosen):
        raise InputError.at(
            "--estimators",
            wanted="none of the published filters with --no-peers",
            found=", ".join(n for n in chosen if n in PEERS),
            fix="leave one of the two out",
        )
    ours = [n for n in chosen if n in ESTIMATORS]
    if not ours + peers:
        raise InputError.at(
            "--estimators",
            wanted="at least one",
            found="none",
            fix=f"choose some of {', '.join(known)}",
        )
    return ours, peers


def _number(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


def _figures(rmse: AttitudeRmse) -> dict[str, float | None]:
    return {k: _number(v) for k, v in rmse._asdict().items()}


def _mean(results: Sequence[Result], trials: Collection[str]) -> dict[str, float | None] | None:
    """Plain mean over some trials; None if there is none."""
    figures = [r.rmse for r in results if r.trial in trials]
    if not figures:
        return None
    return _figures(AttitudeRmse(*np.mean(np.array(figures), axis=0).tolist()))


def _row(
    name: str, level: str, results: Sequence[Result], folders: Mapping[str, Collection[str]]
) -> dict[str, Any]:
    """One estimator at one level: means, worst cases, and every trial.

    ``folders``: trials with truth by folder.
    """
    against = [r.vs_float for r in results if r.vs_float is not None]
    trials = []
    for r in results:
        trials.append(
            {
                "trial": r.trial,
                **_figures(r.rmse),
                "vs_float_max_deg": None if r.vs_float is None else _number(r.vs_float.max_deg),
                "status_changed": None if r.vs_float is None else r.vs_float.status_changed,
                "saturated_updates": r.saturated,
            }
        )
    saturated = [r.saturated for r in results if r.saturated is not None]
    return {
        "estimator": name,
        "level": level,
        "kind": "peer" if level == "package" else "ours",
        "summary": PEERS[name].summary if level == "package" else ESTIMATORS[name].summary,
        "mean_deg": _mean(results, [t for held in folders.values() for t in held]),
        "mean_by_folder_deg": {folder: _mean(results, held) for folder, held in folders.items()},
        "vs_float_max_deg": _number(max(v.max_deg for v in against)) if against else None,
        "status_changed": sum(v.status_changed for v in against) if against else None,
        "saturated_updates": sum(saturated) if saturated else None,
        "seconds": round(sum(r.seconds for r in results), 3),
        "trials": trials,
    }


def accuracy(
    *logs: str | Path,
    estimators: Sequence[str] | None = None,
    peers: bool = True,
    floating: bool = True,
    comparisons: Collection[str] = (),
    params: Mapping[str, Mapping[str, float]] | None = None,
    word: int = 32,
    jobs: int | None = None,
    output: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Orientation, heading and inclination RMSE of every estimator on every log.

    With more than one job, a script that calls this needs ``if __name__ == "__main__"``.

    Parameters
    ----------
    logs : paths
        Logs, or folders of logs; the bundled ones by default.
    estimators : sequence of str, optional
        Ours and published ones, by name; all by default.
    peers : bool
        Whether published filters run; without them, logs without reference are left out.
    floating : bool
        Whether the float reference of ours runs too, and fixed point is compared with it.
    comparisons : names of logs
        Their reference is another device's estimate: shown, but no part of the means.
    params : mapping, optional
        Parameter values by estimator.
    word : int
        Word width.
    jobs : int, optional
        Processes; one for each processor by default.
    output : path, optional
        Folder for accuracy.html and accuracy.json.

    Raises
    ------
    InputError
        Bad logs, unknown names, illegal parameters, a folder that cannot be written.
    ToolMissing
        The package of a published filter is not here.
    """
    ours, others = _chosen(estimators, peers)
    check_word(word)
    check_number("jobs", 1 if jobs is None else jobs, 1, JOBS_MOST)
    if peers:
        require_peers([PEERS[name] for name in {*others, STAND_IN}])
    for name in ours:
        ESTIMATORS[name]().param_values((params or {}).get(name))
    trials, left_out = read_trials(logs, comparisons=comparisons, stand_in=peers)
    if not trials:
        raise InputError.at(
            "logs",
            wanted="at least one log with a reference attitude",
            found="none",
            fix="name logs with truth",
        )

    def work() -> dict[str, Any]:
        if progress is not None and not logs:
            progress("no log named: the bundled ones")
        results = benchmark(
            ours,
            others,
            trials,
            params=params,
            word=word,
            with_float=floating,
            jobs=jobs,
            progress=progress,
        )
        folders: dict[str, list[str]] = {}
        for t in trials:
            if t.reference == "truth":
                folders.setdefault(t.folder, []).append(t.log.name)
        keys = list(dict.fromkeys((r.estimator, r.level) for r in results))
        return {
            "source": SOURCE,
            "word": word,
            "logs": [
                {
                    "trial": t.log.name,
                    "samples": len(t.log),
                    "rate_hz": round(1.0 / float(np.median(t.log.dt)), 3),
                    "reference": t.reference,
                    "folder": t.folder,
                }
                for t in trials
            ],
            "left_out": left_out,
            "parameters": {name: dict(values) for name, values in (params or {}).items()},
            "estimators": [
                _row(
                    name,
                    level,
                    [r for r in results if (r.estimator, r.level) == (name, level)],
                    folders,
                )
                for name, level in keys
            ],
        }

    if output is None:
        return work()
    files = ("accuracy.html", "accuracy.json")
    with output_folder(output, "accuracy", files=files, inputs=log_files(logs)) as folder:
        data = work()
        (folder / "accuracy.json").write_text(json.dumps(data, indent=1) + "\n")
        (folder / "accuracy.html").write_text(render_page(data), encoding="utf-8")
    return data


# -- text ---------------------------------------------------------------------------------------


def _deg(value: float | None, width: int = 7, digits: int = 2) -> str:
    return f"{'-':>{width}s}" if value is None else f"{value:{width}.{digits}f}"


def _count(value: int | None, width: int) -> str:
    return f"{'-':>{width}s}" if value is None else f"{value:{width},d}"


def _table(
    rows: Sequence[Mapping[str, Any]],
    names: Sequence[str],
    title: str,
    figure: Callable[[Mapping[str, Any], str], float | None],
    reference: str = "",
) -> list[str]:
    """Trials (or folders) down, estimators across: one figure of each but the reference."""
    width = max(len(n) for n in names)
    lines = [
        "",
        title,
        f"  {'':{width}s}" + "".join(f"{f'[{k + 1}]':>7s}" for k in range(len(rows))),
    ]
    return lines + [
        f"  {name:{width}s}"
        + "".join(
            _deg(None if row["estimator"] == reference else figure(row, name)) for row in rows
        )
        for name in names
    ]


def _total(row: Mapping[str, Any], trial: str) -> float | None:
    found: float | None = next(t["total"] for t in row["trials"] if t["trial"] == trial)
    return found


def _folder_total(row: Mapping[str, Any], folder: str) -> float | None:
    found: float | None = (row["mean_by_folder_deg"][folder] or {"total": None})["total"]
    return found


def accuracy_text(data: Mapping[str, Any]) -> str:
    """The result as text for people: ours in fixed point, and how far float is from that."""
    rows = [r for r in data["estimators"] if r["level"] != "float"]
    floating = {r["estimator"]: r for r in data["estimators"] if r["level"] == "float"}
    by_kind: dict[str, list[str]] = {}
    for log in data["logs"]:
        by_kind.setdefault(log["reference"], []).append(log["trial"])
    truth = by_kind.pop("truth", [])
    width = max(len(r["estimator"]) for r in rows)
    none: dict[str, None] = dict.fromkeys(AttitudeRmse._fields)
    lines = [
        f"RMSE in degrees, mean over {len(truth)} trial{'s' if len(truth) != 1 else ''} with "
        f"truth. Ours: fixed point, W = {data['word']};",
        "float64 beside it, and over every sample of all logs the largest angle between the two,",
        "samples whose status words differ, updates that saturated.",
        f"  {'':{width + 5}s}{'total':>7s}{'heading':>9s}{'inclin.':>9s}"
        f"{'float total':>13s}{'fixed-float':>13s}{'status':>9s}{'saturated':>11s}",
    ]
    for k, row in enumerate(rows):
        mean = row["mean_deg"] or none
        line = (
            f"  {f'[{k + 1}]':>4s} {row['estimator']:{width}s}"
            + _deg(mean["total"])
            + _deg(mean["heading"], 9)
            + _deg(mean["inclination"], 9)
        )
        if row["kind"] == "ours":
            other = floating.get(row["estimator"], {}).get("mean_deg") or none
            line += (
                _deg(other["total"], 13)
                + _deg(row["vs_float_max_deg"], 13, 6)
                + _count(row["status_changed"], 9)
                + _count(row["saturated_updates"], 11)
            )
        lines.append(line)
    folders = list(rows[0]["mean_by_folder_deg"])
    if len(folders) > 1:
        lines += _table(rows, folders, "Total RMSE, mean by folder, degrees", _folder_total)
    if truth:
        lines += _table(rows, truth, "Total RMSE by trial, degrees", _total)
    for kind, names in by_kind.items():
        lines += _table(
            rows,
            names,
            "Not truth, outside the means: against the log's comparison"
            if kind == "comparison"
            else f"No reference, outside the means: difference to {kind}",
            _total,
            kind,
        )
    if data["left_out"]:
        lines += ["", "left out, no reference: " + ", ".join(data["left_out"])]
    return "\n".join(lines)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "logs", nargs="*", metavar="LOG", help="logs, or folders of logs; default: the bundled logs"
    )
    parser.add_argument("--estimators", metavar="A,B,...", help="ours and published; default: all")
    parser.add_argument("--no-peers", action="store_true", help="without the published ones")
    parser.add_argument("--no-float", action="store_true", help="fixed point only")
    parser.add_argument(
        "--comparison",
        metavar="LOG,...",
        default="",
        help="logs whose reference is another device's estimate, not truth",
    )
    parser.add_argument("--jobs", type=int, help="processes; default: one for each processor")
    number_options(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="also write accuracy.html and .json")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    names = None if args.estimators is None else args.estimators.split(",")
    ours = [n for n in ESTIMATORS if names is None or n in names]
    data = accuracy(
        *args.logs,
        estimators=names,
        peers=not args.no_peers,
        floating=not args.no_float,
        comparisons=[name for name in args.comparison.split(",") if name],
        params=params_by_estimator(ours, args.params, args.param),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=progress_of(args),
    )
    text = accuracy_text(data)
    return 0, data, text if args.output is None else f"{text}\n\n{args.output}/accuracy.html"
