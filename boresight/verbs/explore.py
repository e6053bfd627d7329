"""Compare word widths, machines and parts.

boresight explore mekf log.csv -o build  # six widths, one and two lanes
boresight explore my_filter.py log.csv --word 18,20,24  # three widths
boresight explore my_filter.py log.csv taps=4,8,16  # an argument of the constructor
boresight explore mekf log.csv --want "attitude<0.01deg, dsp<=1, us<5" --least lut  # choose
boresight explore mekf log.csv --target xc6slx9,ecp5-25k --synth  # areas of two parts
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from boresight import options
from boresight.gateware.machine import machine_named
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import OutputFile
from boresight.model.words.fixed import check_word
from boresight.sim.campaign import Journal, complete
from boresight.sim.explore import table
from boresight.sim.explore.measure import (
    Case,
    Exploration,
    arguments_of,
    cases_of,
    digest_of,
    measured,
    planned,
)
from boresight.sim.pages import Section, Verdict, page_of, section_of
from boresight.sim.plotting import PALETTE, figure_and_axes, legend, settings, svg
from boresight.sim.records.feed import feed
from boresight.sim.records.files import logs_of
from boresight.sim.result import Result, Row
from boresight.sim.worlds.world import is_world

GROUPS = (options.LogRows, options.Profiles, options.Tolerances)

_Words = Annotated[Sequence[int], options.Texts, Parameter(name="--word", metavar="BITS,...")]
_Configs = Annotated[Sequence[str], options.Texts, Parameter(name="--config", metavar="NAME,...")]
_Targets = Annotated[Sequence[str], options.Texts, Parameter(name="--target", metavar="NAME,...")]


def explore(
    estimator: options.EstimatorName,
    /,
    *logs: options.Logs,
    words: _Words = (18, 20, 22, 24, 28, 32),
    configs: _Configs = ("small", "fast"),
    targets: _Targets = ("xc6slx9",),
    synth: bool = False,
    want: str = "",
    least: str = "",
    clock: float = 100.0,
    steps: options.Steps = None,
    params: options.Params = None,
    jobs: options.Jobs = None,
    again: bool = False,
    scheduler: options.Scheduler = None,
    output: options.OutputFolder = "build",
    progress: options.Progress = None,
) -> Result:
    """Measure combinations of word width, machine and target, and choose one.

    Results are stored in ``explore-NAME.jsonl``: later runs read and extend it, and an interrupted
    run continues. The page is ``explore-NAME.html``. A row says why a combination cannot be built,
    or why `check` would refuse it.

    Parameters
    ----------
    estimator : str, class or Estimator
        Name, FILE.py or FILE.py:CLASS.
    logs : paths, worlds, or data in memory (`Record.of`)
        Logs, folders of logs, or worlds, whose loop with the float64 form is the log; also
        arguments of the constructor with values to try, for example taps=4,8,16.
    words : sequence of int
        Word widths, 18 to 32 bits.
    configs : sequence of str
        Machines, as in compile.
    targets : sequence of str
        Parts for area and clock.
    synth : bool
        Also synthesise with yosys: area, and on Spartan-6 an estimate of the clock.
    want : str
        Limits with commas, for example attitude<0.01deg, dsp<=1, us<5. docs/learn/explore.md lists
        the figures; the name of an output stands for its largest error from float64.
    least : str
        Figure that is minimised among the rows within all limits; by default that of the first
        limit.
    clock : float
        Clock in MHz, for the figures us and rate.
    steps : int, optional
        Use at most this many samples of each log.
    params : mapping, optional
        Parameter values.
    jobs : int, optional
        Number of processes; by default one for each processor. An estimator that is given as an
        object runs in this process.
    again : bool
        Measure everything again, also stored rows.
    scheduler : str, optional
        Address of a Dask cluster that measures; its workers must see the same files.
    output : path
        Folder for page and table.

    Returns
    -------
    Result
        ``rows``, one for each combination with its figures, and ``choice``.

    Raises
    ------
    InputError
        Unknown names, bad logs, a limit of an unknown figure.
    ToolMissing
        yosys is missing with ``synth``, or the C compiler.
    """
    say = progress or (lambda text: None)
    for word in words:
        fix = "write for example 18,24,32"
        require(str(word).strip().isdigit(), "words", "whole numbers", word, fix)
        check_word(int(word))
    require(1.0 <= clock <= 10_000.0, "clock", "1 to 10,000 MHz", clock, "choose another")
    for name, value in (("steps", steps), ("jobs", jobs)):
        require_whole(name, value, 1)
    for config in configs:
        machine_named(config)
    for target in targets:
        require_choice("target", target, TARGETS)
    sources, arguments = arguments_of(logs)
    worlds = tuple(s for s in sources if is_world(s))
    widths = [*map(int, words)]
    cases = cases_of(estimator, arguments, words=widths, configs=configs, targets=targets)
    found = _first(cases)
    values = options.params_of(found, params)
    known = table.quantities(found)
    demands = table.demands_of(want, known)
    decides = demands[0].quantity if demands else None
    if least:
        decides = table.quantity_of(least, known, "least")
    asked = [demand.quantity.name for demand in demands] + [q.name for q in [decides] if q]
    for figure in table.OF_AREA:
        good = synth or figure not in asked
        require(good, "want", f"areas and clocks, for {figure}", "no --synth", "add --synth")
    read = logs_of([s for s in sources if not is_world(s)], load=True)
    fix = "name a log, or a world as file.py:Class"
    require(bool(read or worlds), "logs", "at least one log or world", None, fix)
    for log in [] if arguments else read:
        feed(found, log.first)
    files = [log.path for log in read if log.path is not None]
    folder, of = Path(output), f"explore-{found.name}"
    page = OutputFile(folder / f"{of}.html", inputs=files)
    journal = Journal(folder / f"{of}.jsonl", again=again)
    journal.rows = {key: row for key, row in journal.rows.items() if not row.get("again")}
    say(f"{found.name}: {len(cases)} combinations")
    exploration = Exploration(
        tuple(log.first if log.path is None else str(log.path.absolute()) for log in read),
        worlds,
        tuple(sorted((values or {}).items())),
        steps,
        digest_of([log.first for log in read]),
    )
    plans, tasks = planned(exploration, cases, area=synth)
    shared = all(isinstance(x, str) for x in (estimator, *worlds))
    where: Any = {"jobs": jobs, "scheduler": scheduler, "shared": shared}
    complete(exploration, measured, tasks, journal, say=say, batch=1, **where)
    of_all = plans, journal.rows, exploration, known, demands
    result = table.result_of(*of_all, least=decides, clock_mhz=clock)
    page.write(render_page(found.name, result))
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


def render_page(title: str, result: Result) -> str:
    """The page's text, which needs no other file."""
    rows = result["rows"]
    (name, shown), *_ = result.tables.items()
    error = list(shown[0])[1]
    cost = next((c for c in ("lut", "cycles") if any(row.get(c) for row in rows)), None)
    figures = [] if cost is None or not error else [("", _plot(rows, error, cost))]
    commands = [
        (row["combination"], command) for row in rows if row["good"] for command in row["commands"]
    ]
    summary = [text for text in result.summary.splitlines() if text != table.ESTIMATED]
    return page_of(
        f"Exploration of {title}",
        [*summary, *(Verdict(text, good=False) for text in result.failures)],
        [
            replace(section_of(name, shown), figures=figures),
            Section(title="Commands", columns=("combination", "command"), rows=commands),
        ],
        note=table.ESTIMATED if table.ESTIMATED in result.summary else "",
    )


def _plot(rows: list[Row], error: str, cost: str) -> str:
    """SVG of the error over the cost, a curve for each machine; hollow where check fails."""
    series: dict[str, list[Row]] = {}
    for row in rows:
        if row.get(cost) is not None and (row.get(error) or 0.0) > 0.0:
            head = row["combination"].replace(f"{row['word']} bits, ", "")
            series.setdefault(head, []).append(row)
    with settings():
        figure, axes = figure_and_axes(3.6)
        for (head, of), colour in zip(series.items(), PALETTE * len(series), strict=False):
            points = [(row[cost], row[error]) for row in of]
            axes.plot(*zip(*points, strict=True), color=colour, linewidth=0.6, label=head)
            for row, place in zip(of, points, strict=True):
                face = colour if row["good"] else "white"
                axes.plot(*place, "o", color=colour, markerfacecolor=face)
                offset = {"xytext": (5, 4), "textcoords": "offset points"}
                axes.annotate(str(row["word"]), place, **offset)
        axes.set_yscale("log")
        axes.set_xlabel(cost)
        axes.set_ylabel(f"largest error: {error}")
        if series:
            legend(axes, 4)
        return svg(figure, "explore")
