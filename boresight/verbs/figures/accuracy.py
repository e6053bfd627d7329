"""Error of our estimators and of published ones on logs with truth.

boresight accuracy  # the attitude filters and VQF on the bundled logs
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder -o build  # ours beside VQF, Madgwick, Mahony, an EKF
boresight accuracy mekf flight.ulg --align heading  # a constant offset of the heading taken out
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

from boresight.arguments import JOBS_MOST, check_optional, check_word
from boresight.filters import chosen, params_by_estimator
from boresight.model.errors import InputError, require_choice
from boresight.model.resolve import Named, estimator_of
from boresight.model.tools.files import output_folder
from boresight.options import Arguments, Jobs, Option, Outcome, Params, Word, outcome
from boresight.regression import JudgedVerb
from boresight.results.accuracy import AccuracyResult
from boresight.sim.accuracy.benchmark import benchmark
from boresight.sim.accuracy.benchmark_page import render_page
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.trials import STAND_IN, read_trials
from boresight.sim.rotations.accuracy import ALIGNMENTS

__all__ = ["accuracy"]

#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"


def accuracy(
    names: Named | Sequence[Named],
    *logs: Any,
    floating: Annotated[bool, Option(("--no-float",))] = True,
    comparisons: Annotated[Collection[str], Option(("--comparison",), "LOG,...")] = (),
    align: str = "none",
    declination: float = 0.0,
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
    align : str
        Constant offset between estimate and reference that is taken out of attitudes first, and
        printed: none, heading (about the vertical) or full.
    declination : float
        Of magnetic north, degrees, positive to the east: references count from true north, and
        are turned.
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
    require_choice("align", align, ALIGNMENTS)
    if not abs(declination) <= 180.0:
        raise InputError.at(
            "--declination",
            wanted="-180 to 180 degrees",
            found=f"{declination:g}",
            fix="choose another",
        )
    check_optional("jobs", jobs, 1, JOBS_MOST)
    if peers:
        require_peers([PEERS[name] for name in {*peers, STAND_IN}])
    for e in ours:
        e.param_values((params or {}).get(e.name))
    if not logs and (other := next((e for e in ours if not gives_attitude(e)), None)):
        raise InputError.at(
            "logs",
            wanted=f"a log with truth for {other.name}",
            found="none named",
            fix="name one after the estimator; the bundled ones are of attitudes",
        )
    if align != "none" and (other := next((e for e in ours if not gives_attitude(e)), None)):
        raise InputError.at(
            "--align",
            wanted="attitudes, outputs qw qx qy qz",
            found=f"{other.name}, which has none",
            fix="leave --align out",
        )
    trials, left_out = read_trials(
        logs, ours, comparisons=comparisons, peers=bool(peers), declination_deg=declination
    )
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
        results = benchmark(
            ours,
            peers,
            trials,
            params=params,
            word=word,
            with_float=floating,
            align=align,
            jobs=jobs,
            progress=progress,
        )
        return AccuracyResult.of(
            ours,
            trials,
            results,
            [log.name for log in left_out],
            params or {},
            word,
            align,
            declination,
        )

    if output is None:
        return work()
    made = ("accuracy.html", "accuracy.json")
    files = [log.path for log in (*(t.log for t in trials), *left_out) if log.path]
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
) -> Outcome:
    """On logs, by default the bundled ones.

    Parameters
    ----------
    names : str, optional
        Estimators and published filters, or: ours, published, all; by default the attitude
        filters and VQF.
    logs : paths
        Logs, or folders of logs; by default the bundled logs.
    """
    typed = arguments.typed
    names = names or FIRST
    if "comparisons" in typed:
        typed["comparisons"] = ",".join(filter(None, typed["comparisons"].split(",")))
    params = params_by_estimator(chosen(names)[0], *arguments.params)
    result = arguments.call(accuracy, names, *logs, params=params)
    folder = typed.get("output")
    return outcome(result, "" if folder is None else f"\n\n{folder}/accuracy.html")


VERB = JudgedVerb(accuracy, call=call, judged=AccuracyResult.judged)
