"""`boresight accuracy`: estimators against truth; attitude filters beside published ones."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.arguments import JOBS_MOST, check_number, check_word
from boresight.disk.output import output_folder
from boresight.filters import chosen, params_by_estimator
from boresight.model.errors import InputError
from boresight.model.resolve import Named, estimator_of
from boresight.options import Outcome, number_options, progress_of, refuse_options
from boresight.results.accuracy import AccuracyResult
from boresight.sim.accuracy.benchmark import benchmark
from boresight.sim.accuracy.benchmark_page import render_page
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.protocol.plan import PROTOCOLS
from boresight.sim.accuracy.trials import STAND_IN, read_trials
from boresight.sim.records.files import log_files
from boresight.verbs.figures.protocol import accuracy_protocol

__all__ = ["accuracy", "add_arguments", "call"]

#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"


def accuracy(
    names: Named | Sequence[Named],
    *logs: Any,
    floating: bool = True,
    comparisons: Collection[str] = (),
    params: Mapping[str, Mapping[str, float]] | None = None,
    word: int = 32,
    jobs: int | None = None,
    output: str | Path | None = None,
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
        Whether compiled float64 runs too, and fixed point is compared with it.
    comparisons : names of logs
        Their reference is another device's estimate: shown, but no part of the means.
    params : mapping, optional
        Parameter values by estimator.
    word : int
        Word width.
    jobs : int, optional
        Threads and processes; one for each processor by default.
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
        return AccuracyResult.of(ours, trials, results, left_out, params or {}, word)

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


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument(
        "estimators",
        nargs="?",
        metavar="ESTIMATOR[,ESTIMATOR...]",
        help=f"estimators and published filters, or: ours, published, all; without anything "
        f"{FIRST} at a glance",
    )
    parser.add_argument(
        "logs", nargs="*", metavar="LOG", help="logs, or folders of logs; default: the bundled logs"
    )
    parser.add_argument(
        "--protocol",
        metavar="NAME",
        help=f"{', '.join(PROTOCOLS)}: each log cut, biased, resampled, blinded, ...; without logs "
        "the bundled ones and four synthetic carriers",
    )
    parser.add_argument("--no-float", action="store_true", help="fixed point only")
    parser.add_argument(
        "--comparison",
        metavar="LOG,...",
        default="",
        help="logs whose reference is another device's estimate, not truth",
    )
    parser.add_argument("--jobs", type=int, help="at once; default: one for each processor")
    number_options(parser)
    parser.add_argument("-o", "--output", metavar="DIR", help="also write accuracy.html and .json")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    if args.estimators is None:
        args.estimators, args.protocol = FIRST, args.protocol or "glance"
    if args.protocol is not None:
        return _call_protocol(args)
    result = accuracy(
        args.estimators,
        *args.logs,
        floating=not args.no_float,
        comparisons=[name for name in args.comparison.split(",") if name],
        params=params_by_estimator(chosen(args.estimators)[0], args.params, args.param),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=progress_of(args),
    )
    text = str(result)
    if args.output is not None:
        text += f"\n\n{args.output}/accuracy.html"
    return int(not result.good), result.to_json(), text


def _call_protocol(args: Namespace) -> Outcome:
    refuse_options(
        args,
        add_arguments,
        ("no_float", "comparison"),
        wanted="logs alone",
        found="a protocol, which runs float64 and needs truth",
    )
    result = accuracy_protocol(
        args.protocol,
        args.estimators,
        *args.logs,
        params=params_by_estimator(chosen(args.estimators)[0], args.params, args.param),
        word=args.word,
        jobs=args.jobs,
        output=args.output or "build",
        progress=progress_of(args),
    )
    return int(not result.good), result.to_json(), f"{result}\n\n{result.page}"
