"""Measure errors against the truth of logs, beside published filters.

boresight accuracy  # the attitude filters and VQF on the bundled logs
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder -o build  # ours beside VQF, Madgwick, Mahony, an EKF
boresight accuracy mekf flight.ulg --align heading  # without a constant offset of the heading
"""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.util import find_spec

from boresight.filters import chosen, params_by_estimator
from boresight.model.errors import require_choice, require_whole
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import output_folder
from boresight.model.words.fixed import check_word
from boresight.options import (
    EstimatorNames,
    Jobs,
    LogRows,
    Logs,
    OptionalFolder,
    Params,
    Profiles,
    Progress,
    Word,
)
from boresight.regression import Baseline
from boresight.sim.accuracy.benchmark import JUDGED, benchmark, require_attitudes
from boresight.sim.accuracy.page import render_page
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.trials import read_trials
from boresight.sim.result import Result
from boresight.sim.rotations.accuracy import ALIGNMENTS

__all__ = ["GROUPS", "accuracy"]

GROUPS = (LogRows, Profiles, Baseline)

#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"


def accuracy(
    names: EstimatorNames = FIRST,
    /,
    *logs: Logs,
    align: str = "none",
    params: Params = None,
    word: Word = 32,
    jobs: Jobs = None,
    output: OptionalFolder = None,
    progress: Progress = None,
) -> Result:
    """Measure the error of each output against the truth of logs, and against float64.

    A script that calls this with published filters and more than one job needs
    ``if __name__ == "__main__"``.

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
    output : path, optional
        Folder for accuracy.html and accuracy.json.

    Returns
    -------
    Result
        ``estimators``: errors of each in every form, over all logs (``mean``) and by log.

    Raises
    ------
    InputError
        Bad logs, unknown names, illegal parameters, or a folder that cannot be written.
    ToolMissing
        The package of a published filter that is named is not installed.
    """
    say = progress or (lambda text: None)
    named, peers = chosen(names)
    ours = [estimator_of(n) for n in named]
    check_word(word)
    require_choice("align", align, ALIGNMENTS)
    require_whole("jobs", jobs, 1)
    missing = [n for n in peers if names == FIRST and not find_spec(PEERS[n].package)]
    peers = [n for n in peers if n not in missing]
    require_peers([PEERS[name] for name in peers])
    values = params_by_estimator(named, params)
    if not logs:
        fix = "name one after the estimator; the bundled ones are of attitudes"
        require_attitudes(ours, "logs", fix)
        say("no log named: the bundled ones")
    if align != "none":
        require_attitudes(ours, "--align", "leave --align out")
    trials, left_out = read_trials(logs, ours, load=bool(peers))

    def work() -> Result:
        result = benchmark(
            ours, peers, trials, params=values, word=word, align=align, jobs=jobs, say=say
        )
        notes = [f"log {log.name} has no truth: left out" for log in left_out]
        notes += [f"{n} left out: its package {PEERS[n].package} is missing" for n in missing]
        return replace(result, notes=(*result.notes, *notes), judged=JUDGED)

    if output is None:
        return work()
    files = [log.path for log in (*(t.log for t in trials), *left_out) if log.path]
    made = ("accuracy.html", "accuracy.json")
    with output_folder(output, "accuracy", files=made, inputs=files) as folder:
        result = work()
        data = json.dumps(result.to_json(), indent=1)
        (folder / "accuracy.json").write_text(data + "\n")
        (folder / "accuracy.html").write_text(render_page(result), encoding="utf-8")
    summary = f"{result.summary}\n{output}/accuracy.html".strip()
    return replace(result, summary=summary)
