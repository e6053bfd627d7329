"""Measure errors against the truth of logs, beside published filters.

boresight accuracy  # the attitude filters and VQF on the bundled logs
boresight accuracy my_filter.py log.csv  # each output in its unit
boresight accuracy all folder -o build  # ours beside VQF, Madgwick, Mahony, an EKF
boresight accuracy mekf flight.ulg --align heading  # without a constant offset of the heading
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

from boresight.model.errors import InputError, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, offered, split_names
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
from boresight.parameters import params_of_each
from boresight.regression import Baseline
from boresight.sim.accuracy.benchmark import JUDGED, benchmark, require_attitudes
from boresight.sim.accuracy.figures import ALIGNMENTS
from boresight.sim.accuracy.peers import PEERS, require_peers
from boresight.sim.accuracy.trials import read_trials
from boresight.sim.pages import Section, Verdict, page_of, section_of
from boresight.sim.plotting import dots
from boresight.sim.result import Result

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
        The package of a named published filter is not installed.
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


def render_page(result: Result) -> str:
    """The page's text, which needs no other file."""
    rows = [row for row in result["estimators"] if row["level"] != "float"]
    logs = [log["trial"] for log in result["logs"]]
    errors: dict[str, str] = {name: unit for row in rows for name, unit in row["units"].items()}
    sections = [section_of(title, table) for title, table in result.tables.items()]
    for name, unit in errors.items():
        series = {
            row["estimator"]: _on_logs(row, "error", name) for row in rows if name in row["units"]
        }
        label = f"error: {name} {unit}".rstrip()
        sections.append(
            Section(title=f"Error on each log: {name}", figures=[("", dots(logs, series, label))])
        )
    near = {
        f"{row['estimator']}, {d['output']} {d['unit']}".rstrip(): _on_logs(
            row, "vs_float", d["output"]
        )
        for row in rows
        for d in row["vs_float"]
        if d["tolerance"] is not None
    }
    if near:
        label = "largest difference between fixed point and float64"
        sections.append(Section(title="Fixed point", figures=[("", dots(logs, near, label))]))
    intro: list[str | Verdict] = [result["source"] + "."]
    intro += [Verdict(text, good=False) for text in result.failures]
    return page_of("Accuracy", intro, sections)


def _on_logs(row: Mapping[str, Any], key: str, name: str) -> list[float | None]:
    return [trial[key].get(name) for trial in row["trials"]]


def groups() -> dict[str, list[str]]:
    """Words for several names; "ours" are estimators with the inputs of the published filters."""
    installed, _ = offered(Estimator, "estimator", ESTIMATOR_GROUP)
    ours = [name for name, kind in installed.items() if kind.inputs == INPUTS]
    return {"ours": ours, "published": list(PEERS), "all": [*ours, *PEERS]}


def chosen(names: Named | Sequence[Named]) -> tuple[list[Named], list[str]]:
    """Split names into estimators and published filters.

    A text holds one or several names with commas, or words of `groups`.

    Raises
    ------
    InputError
        A name twice, or none.
    """
    words = groups()
    members: list[Named] = []
    for name in [names] if isinstance(names, str | Estimator | type) else names:
        for text in split_names(name) if isinstance(name, str) else [name]:
            members += words.get(text, [text]) if isinstance(text, str) else [text]
    duplicates = [n for k, n in enumerate(members) if isinstance(n, str) and n in members[:k]]
    if duplicates or not members:
        raise InputError.at(
            "estimators",
            wanted="at least one, each once",
            found=f"{duplicates[0]} twice" if duplicates else "none",
            fix=f"name some, or one of {', '.join(words)}",
        )
    published = [n for n in members if isinstance(n, str) and n in PEERS]
    return [n for n in members if n not in published], published


def params_by_estimator(
    names: Sequence[Named], params: Mapping[str, Any] | Sequence[str] | None
) -> dict[str, Mapping[str, float]]:
    """Parameter values by estimator: from Python by estimator, or texts of the command line.

    Raises
    ------
    InputError
        Values whose estimator is unknown or not among ``names``.
    """
    if params and not names:
        raise InputError.at(
            "parameters",
            wanted="an estimator with parameters",
            found="published filters only",
            fix="name an estimator, or leave the values out",
        )
    own = [estimator_of(name).name for name in names]
    if isinstance(params, Mapping) and len(own) == 1 and own[0] in params:
        params = params[own[0]]
    values = params_of_each(names, params)
    return {name: some for name, some in zip(own, values, strict=True) if some}
