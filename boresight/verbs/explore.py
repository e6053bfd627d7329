"""How many bits, which machine, which part: errors and costs of many combinations.

boresight explore mekf log.csv -o build  # six widths, one lane and two: a page and a table
boresight explore my_filter.py log.csv --words 18,20,24 --no-area  # errors and cycles alone
boresight explore my_filter.py log.csv taps=4,8,16  # an argument of the constructor
boresight explore mekf log.csv --want "attitude<0.01deg, dsp<=1, us<5" --least lut  # choose
boresight explore mekf log.csv --target xc6slx9,ecp5-25k --route  # also placed and routed
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from boresight.arguments import (
    JOBS_MOST,
    check_machine,
    check_number,
    check_optional,
    check_routable,
    check_target,
    check_urgent,
    check_word,
)
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import OutputFile, require_distinct
from boresight.options import (
    EstimatorName,
    Jobs,
    Logs,
    Option,
    OutputFolder,
    Params,
    PythonOnly,
    Urgent,
    Verb,
)
from boresight.sim.campaign import Journal, cluster, complete
from boresight.sim.explore.cases import Case, Exploration, arguments_of, cases_of
from boresight.sim.explore.measure import digest_of, measured, planned
from boresight.sim.explore.page import render_page
from boresight.sim.explore.table import (
    OF_AREA,
    csv_of,
    demands_of,
    quantities,
    quantity_of,
    result_of,
)
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs
from boresight.sim.result import Result

__all__ = ["explore"]


def explore(
    name: EstimatorName,
    *logs: Logs,
    words: Annotated[Sequence[int], Option(metavar="BITS,...")] = (18, 20, 22, 24, 28, 32),
    configs: Annotated[Sequence[str], Option(("--config",), "NAME,...")] = ("small", "fast"),
    targets: Annotated[Sequence[str], Option(("--target",), "NAME,...")] = ("xc6slx9",),
    area: bool = True,
    route: bool = False,
    seeds: int = 1,
    want: str = "",
    least: str = "",
    clock: float = 100.0,
    steps: int | None = None,
    params: Params = None,
    urgent: Urgent = None,
    csv: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    jobs: Jobs = None,
    again: bool = False,
    scheduler: Annotated[str | None, Option(metavar="ADDRESS")] = None,
    executor: Annotated[Any, PythonOnly] = None,
    output: OutputFolder = "build",
    progress: Callable[[str], None] | None = None,
) -> Result:
    """Measure combinations of word, machine and target, and choose one.

    Everything measured is stored in ``explore-NAME.jsonl``: later runs read and extend it, and an
    interrupted run continues. The page is ``explore-NAME.html``. A row says why a combination
    cannot be built, or why `check` would refuse it.

    Parameters
    ----------
    name : str, class or Estimator
    logs : paths, or data in memory (`Record.of`)
        Logs, or folders of logs; also arguments of the constructor with the values to try,
        taps=4,8,16.
    words : sequence of int
        Word widths, 18 to 32 bits.
    configs : sequence of str
        Machines, as compile has them.
    targets : sequence of str
        Parts for area and clock.
    area : bool
        Without area and estimated clock, by far the longest.
    route : bool
        Also place and route on targets for which there is an open tool: minutes for each.
    seeds : int
        How often with --route; the slowest counts.
    want : str
        Demands on figures with commas: attitude<0.01deg, dsp<=1, us<5. Figures are those of the
        docs/learn/explore.md: an output's name is its largest error from float64.
    least : str
        Which of those that meet the demands is chosen: the one with least of this figure; by
        default of the first demand.
    clock : float
        For times, MHz.
    steps : int, optional
        Leading samples of each log.
    params : mapping, optional
        Values other than the defaults.
    csv : path, optional
        Also the table, as CSV.
    jobs : int, optional
        Processes; by default one for each processor. An estimator that is no text runs in this
        process.
    again : bool
        Measure everything again, also what is stored.
    scheduler : str, optional
        Address of a Dask cluster whose workers measure instead; they see the same files.
    executor : concurrent.futures.Executor, optional
        Measures instead of both.
    output : path
        Folder of page and table.

    Returns
    -------
    Result
        ``rows``, one for each combination with its figures, and ``choice``.

    Raises
    ------
    InputError
        Unknown names, bad logs, a demand on a figure that does not exist.
    ToolMissing
        There is no yosys, and ``area`` is wanted; no router, and ``route`` is; no C compiler.
    """
    say = progress or (lambda text: None)
    _check_numbers(words=words, clock=clock, steps=steps, jobs=jobs, seeds=seeds)
    for config in configs:
        check_machine(config, 32)
    for target in targets:
        check_target(target, TARGETS)
    if route:
        check_routable(targets, "leave --route out")
    elif seeds != 1:
        raise InputError.at(
            "seeds", wanted="cores that are routed", found="no --route", fix="add --route"
        )
    inputs, arguments = arguments_of(logs)
    widths = [*map(int, words)]
    cases = cases_of(name, arguments, words=widths, configs=configs, targets=targets)
    estimator = _first(cases)
    estimator.param_values(params)
    check_urgent(urgent, [estimator])
    known = quantities(estimator)
    demands = demands_of(want, known)
    decides = demands[0].quantity if demands else None
    if least:
        decides = quantity_of(least, known, "least")
    asked = [demand.quantity.name for demand in demands] + [q.name for q in [decides] if q]
    if not (area or route) and (of_area := [figure for figure in asked if figure in OF_AREA]):
        raise InputError.at(
            "no-area",
            wanted=f"areas and clocks, for {of_area[0]}",
            found="--no-area",
            fix=f"leave it out, or ask for no {of_area[0]}",
        )
    read = read_logs(inputs)
    if not read:
        raise InputError.at("logs", wanted="at least one log", found="none", fix="name a log file")
    for record, _ in read:
        if not arguments:
            feed(estimator, record)
    if scheduler is not None and not isinstance(name, str):
        raise InputError.at(
            "scheduler",
            wanted="an estimator by name or file, which its workers can read",
            found="an object",
            fix="give a text, or leave the scheduler out",
        )
    files = [path for _, path in read if path is not None]
    folder, of = Path(output), f"explore-{estimator.name}"
    require_distinct(csv=csv, output=folder / f"{of}.html")
    page = OutputFile(folder / f"{of}.html", inputs=files)
    table = None
    if csv is not None:
        table = OutputFile(csv, inputs=files, option="--csv")
    journal = Journal(folder / f"{of}.jsonl", again=again)
    journal.rows = {key: row for key, row in journal.rows.items() if not row.get("again")}
    say(f"{estimator.name}: {len(cases)} combinations")
    exploration = Exploration(
        tuple(record if path is None else str(path.absolute()) for record, path in read),
        tuple(sorted((params or {}).items())),
        steps,
        seeds,
        urgent,
        digest_of([record for record, _ in read]),
    )
    plans, tasks = planned(exploration, cases, area=area, route=route)
    with cluster(scheduler, executor) as workers:
        own = jobs if isinstance(name, str) else 1
        complete(
            exploration, measured, tasks, journal, say=say, jobs=own, executor=workers, batch=1
        )
    result = result_of(
        plans,
        journal.rows,
        exploration,
        known=known,
        demands=demands,
        least=decides,
        clock_mhz=clock,
    )
    page.write(render_page(estimator.name, result))
    if table is not None:
        table.write(csv_of(result["rows"]))
    place = f"{folder / of}.html, {journal.path}"
    return replace(result, summary=f"{result.summary}\n{place}".strip())


def _first(cases: Sequence[Case]) -> Estimator:
    """The estimator of the first case that has one; raises the first refusal if none has."""
    refusals = []
    for case in cases:
        try:
            return estimator_of(case.named)
        except InputError as error:
            refusals.append(error)
    raise refusals[0]


def _check_numbers(
    *, words: Sequence[Any], clock: float, steps: int | None, jobs: int | None, seeds: int
) -> None:
    for word in words:
        if not str(word).strip().isdigit():
            raise InputError.at(
                "words", wanted="whole numbers", found=repr(word), fix="write for example 18,24,32"
            )
        check_word(int(word))
    if not 1.0 <= clock <= 10_000.0:
        raise InputError.at(
            "clock", wanted="1 to 10,000 MHz", found=f"{clock:g}", fix="choose another"
        )
    check_optional("steps", steps, 1)
    check_optional("jobs", jobs, 1, JOBS_MOST)
    check_number("seeds", seeds, 1)


VERB = Verb(explore)
