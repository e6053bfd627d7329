"""How many bits, which machine, which part: errors and costs of many combinations.

boresight explore mekf log.csv -o build  # six widths, one lane and two: a page and a table
boresight explore my_filter.py log.csv --words 18,20,24 --no-area  # errors and cycles alone
boresight explore my_filter.py log.csv taps=4,8,16  # an argument of the constructor
boresight explore mekf log.csv --want "attitude<0.01deg, dsp<=1, us<5" --least lut  # choose
boresight explore mekf log.csv --target xc6slx9,ecp5-25k --route  # also placed and routed
boresight explore my_filter.py log.csv --toggles  # also how many nets change, for energy
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
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
from boresight.core_files import has_primitives
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
from boresight.results.explore import ExploreResult
from boresight.sim.campaign import Journal, cluster, complete
from boresight.sim.explore.cases import Planned, arguments_of, cases_of, planned
from boresight.sim.explore.demands import Demand, chosen, demands_of, quantity_of, with_tolerance
from boresight.sim.explore.figures import OF_AREA, Quantity, explored, quantities
from boresight.sim.explore.measure import Case, Exploration, Task, digest_of, measured
from boresight.sim.explore.page import page_data, render_page
from boresight.sim.records.columnar import parquet_of
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_logs

__all__ = ["explore"]

#: Seconds between two states of the page while figures come.
_PAGE_S = 1.0


def explore(
    name: EstimatorName,
    *logs: Logs,
    words: Annotated[Sequence[int], Option(metavar="BITS,...")] = (18, 20, 22, 24, 28, 32),
    configs: Annotated[Sequence[str], Option(("--config",), "NAME,...")] = ("small", "fast"),
    targets: Annotated[Sequence[str], Option(("--target",), "NAME,...")] = ("xc6slx9",),
    area: bool = True,
    route: bool = False,
    seeds: int = 1,
    toggles: bool = False,
    want: str = "",
    least: str = "",
    clock: float = 100.0,
    steps: int | None = None,
    params: Params = None,
    urgent: Urgent = None,
    csv: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    parquet: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    jobs: Jobs = None,
    again: bool = False,
    scheduler: Annotated[str | None, Option(metavar="ADDRESS")] = None,
    executor: Annotated[Any, PythonOnly] = None,
    output: OutputFolder = "build",
    progress: Callable[[str], None] | None = None,
) -> ExploreResult:
    """Measure combinations of word, machine and target, and choose one.

    Everything measured is stored in ``explore-NAME.jsonl``: later runs read and extend it, and an
    interrupted run continues. The page ``explore-NAME.html`` is
    written as soon as there are figures, and again as more come. A combination that cannot be built
    says so in its row.

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
    toggles : bool
        Also count how many nets change in an update, in the simulated netlist for Spartan-6.
    want : str
        Demands on figures with commas: attitude<0.01deg, dsp<=1, us<5. Figures are those of the
        page: an output's name is its largest error from float64. Without a demand on an error,
        errors are to be within the tolerances, declared or by --tolerance.
    least : str
        Which of those that meet the demands is chosen: the one with least of this figure; by
        default of the first demand.
    clock : float
        For times, MHz.
    steps : int, optional
        Leading samples of each log.
    params : mapping, optional
        Values other than the defaults.
    csv, parquet : path, optional
        Also the table, as CSV or Parquet.
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
    ExploreResult
        A sequence of rows, `boresight.sim.explore.figures.Explored`.

    Raises
    ------
    InputError
        Unknown names, bad logs, a demand on a figure that does not exist.
    ToolMissing
        There is no yosys, and ``area`` is wanted; no router, and ``route`` is; no Verilator, and
        ``toggles`` are; no C compiler; no pyarrow, and ``parquet`` is wanted.
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
    if toggles and not any(map(has_primitives, targets)):
        raise InputError.at(
            "toggles",
            wanted="a target whose netlist is simulated, Spartan-6",
            found=f"--target {','.join(targets)}",
            fix="leave --toggles out",
        )
    inputs, arguments = arguments_of(logs)
    widths = [*map(int, words)]
    cases = cases_of(name, arguments, words=widths, configs=configs, targets=targets)
    estimator = _first(cases)
    estimator.param_values(params)
    check_urgent(urgent, [estimator])
    known = quantities(estimator)
    demands = demands_of(want, known)
    wanted = quantity_of(least, known, "least") if least else None
    asked = [demand.quantity.name for demand in demands] + ([wanted.name] if wanted else [])
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
    files = [path for _, path in read if path is not None]
    folder, of = Path(output), f"explore-{estimator.name}"
    require_distinct(csv=csv, parquet=parquet, output=folder / f"{of}.html")
    page = OutputFile(folder / f"{of}.html", inputs=files)
    tables = [
        (OutputFile(path, inputs=files, option=option), content)
        for path, option, content in (
            (csv, "--csv", ExploreResult.csv),
            (parquet, "--parquet", ExploreResult.parquet),
        )
        if path is not None
    ]
    if parquet is not None:
        parquet_of({})
    journal = Journal(folder / f"{of}.jsonl", again=again)
    journal.rows = {key: row for key, row in journal.rows.items() if not row.get("again")}
    say(f"{estimator.name}: {len(cases)} combinations")
    records = [record for record, _ in read]
    exploration = Exploration(
        tuple(record if path is None else str(path.absolute()) for record, path in read),
        tuple(sorted((params or {}).items())),
        steps,
        seeds,
        urgent,
        digest_of(records),
    )
    plans, tasks = planned(exploration, cases, records, area=area, route=route, toggles=toggles)
    table = _Table(
        estimator.name, exploration, plans, tasks, journal, known, demands, wanted, clock, page
    )
    texts = isinstance(name, str)
    if scheduler is not None and not texts:
        raise InputError.at(
            "scheduler",
            wanted="an estimator by name or file, which its workers can read",
            found="an object",
            fix="give a text, or leave the scheduler out",
        )
    with cluster(scheduler, executor) as workers:
        try:
            complete(
                exploration,
                measured,
                tasks,
                journal,
                say=say,
                jobs=jobs if texts else 1,
                executor=workers,
                batch=1,
                after_batch=table.write_at_times,
            )
        finally:
            result = table.write(str(folder / f"{of}.html"))
    for file, content in tables:
        file.write(content(result))
    return result


@dataclass
class _Table:
    """What is measured so far, as a result and on the page."""

    title: str
    exploration: Exploration
    plans: Sequence[Planned]
    tasks: Mapping[str, Task]
    journal: Journal
    quantities: Sequence[Quantity]
    demands: Sequence[Demand]
    least: Quantity | None
    clock: float
    page: OutputFile
    written: float = -math.inf

    def write_at_times(self) -> None:
        """Write the page, unless it was written just now."""
        if time.monotonic() - self.written >= _PAGE_S:
            self.write()
            self.written = time.monotonic()

    def write(self, place: str = "") -> ExploreResult:
        """Write the page; the result."""
        done = self.journal.rows
        rows = tuple(
            explored(plan, done, self.exploration, clock_mhz=self.clock) for plan in self.plans
        )
        seen = {name for row in rows for name in row.figures}
        known = tuple(q for q in self.quantities if q.name in seen)
        least = self.least or (self.demands[0].quantity if self.demands else None)
        demands = with_tolerance(self.demands, known)
        choice = chosen(rows, demands, least) if least is not None else None
        lines = choice.lines(least) if choice is not None and least is not None else []
        left = sum(key not in done for key in self.tasks)
        demands = [d for d in demands if d.quantity in known]
        data = page_data(self.title, rows, known, demands, least, lines, remaining=left)
        self.page.write(render_page(data))
        return ExploreResult(rows, choice, place, str(self.journal.path), known, least)


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
