"""Measure errors against the truth of logs, beside published filters.

boresight accuracy  # the attitude filters and VQF on the bundled logs
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder --json > accuracy.json  # ours beside VQF
boresight accuracy mekf flight.ulg --align heading  # without a constant offset of the heading
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

from boresight import options
from boresight.model.errors import require, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, offered, split_names
from boresight.model.words.fixed import check_word
from boresight.parameters import estimator_names, params_of_each
from boresight.sim.accuracy.benchmark import benchmark
from boresight.sim.accuracy.figures import ALIGNMENTS, gives_attitude
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.runs import read_trials
from boresight.sim.result import Result

GROUPS = (options.LogRows, options.Profiles, options.Baseline)

#: What runs where nothing is named: ours, and the published filters that take seconds.
FIRST = "complementary,ekf_bias,mekf,vqf_online,vqf_basic"


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

    Returns
    -------
    Result
        ``estimators``: errors of each in every form, over all logs (``mean``) and by log.

    Raises
    ------
    InputError
        Bad logs, unknown names, or illegal parameters.
    ToolMissing
        The package of a named published filter is not installed.
    """
    say = progress or (lambda text: None)
    named, peers = chosen(names)
    ours = [estimator_of(n) for n in named]
    check_word(word)
    require_choice("align", align, ALIGNMENTS)
    require_whole("jobs", jobs, 1)
    missing = peers if names == FIRST and not find_spec("vqf") else []
    peers = [] if missing else peers
    require_peers(peers)
    wanted, fix = "an estimator with parameters", "name an estimator, or leave the values out"
    require(bool(ours) or not params, "parameters", wanted, "published filters only", fix)
    each = zip(ours, params_of_each(ours, params), strict=True)
    values = {e.name: some for e, some in each if some}
    for e in [] if logs and align == "none" else ours:
        where, fix = "logs", "name one after the estimator; the bundled ones are of attitudes"
        where, fix = ("--align", "leave --align out") if logs else (where, fix)
        wanted, found = "attitudes, outputs qw qx qy qz", f"{e.name}, which has none"
        require(gives_attitude(e), where, wanted, found, fix)
    if not logs:
        say("no log named: the bundled ones")
    trials, notes = read_trials(logs, ours, load=bool(peers))
    result = benchmark(
        ours, peers, trials, params=values, word=word, align=align, jobs=jobs, say=say
    )
    notes += [f"{n} left out: its package vqf is missing" for n in missing]
    return replace(result, notes=(*result.notes, *notes))


def chosen(names: Named | Sequence[Named]) -> tuple[list[Named], list[str]]:
    """Split names into estimators and published filters.

    A text holds one or several names with commas; "ours" are the estimators with the inputs of the
    published filters, "published" these, "all" both.

    Raises
    ------
    InputError
        An estimator twice, or nothing.
    """
    installed = offered(Estimator, "estimator", ESTIMATOR_GROUP)
    ours = [name for name, kind in installed.items() if kind.inputs == INPUTS]
    words: dict[str, list[Any]] = {"ours": ours, "published": [*PEERS], "all": [*ours, *PEERS]}
    several = [names] if isinstance(names, str | Estimator | type) else names
    texts = [t for n in several for t in (split_names(n) if isinstance(n, str) else [n])]
    members = [m for t in texts for m in (words.get(t, [t]) if isinstance(t, str) else [t])]
    fix = f"name some, or one of {', '.join(words)}"
    require(bool(members), "estimators", "at least one", None, fix)
    published = dict.fromkeys(n for n in members if isinstance(n, str) and n in PEERS)
    own = [n for n in members if not (isinstance(n, str) and n in published)]
    return estimator_names(*own), [*published]
