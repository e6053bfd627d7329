"""Compare word widths, machines and parts.

boresight explore mekf log.csv -o build  # six widths, one and two lanes
boresight explore my_filter.py log.csv --word 18,20,24  # three widths
boresight explore my_filter.py log.csv taps=4,8,16  # an argument of the constructor
boresight explore mekf log.csv --want "attitude<0.01deg, dsp<=1, us<5" --least lut  # choose
boresight explore mekf log.csv --target xc6slx9,ecp5-25k --synth  # areas of two parts
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from cyclopts import Parameter

from boresight import options
from boresight.gateware.machine import machine_named
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.declarations import ATTITUDE, EXACT_UNITS
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.tools.files import OutputFile
from boresight.model.units import conversion
from boresight.model.words.fixed import check_word
from boresight.sim import plotting
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.campaign import Journal, complete
from boresight.sim.explore import measure
from boresight.sim.records.feed import feed
from boresight.sim.records.files import logs_of
from boresight.sim.result import Result, Row
from boresight.sim.worlds.world import is_world

GROUPS = (options.rows, options.profiles, options.tolerances)

_Words = Annotated[Sequence[int], options.Texts, Parameter(name="--word", metavar="BITS,...")]
_Configs = Annotated[Sequence[str], options.Texts, Parameter(name="--config", metavar="NAME,...")]
_Targets = Annotated[Sequence[str], options.Texts, Parameter(name="--target", metavar="NAME,...")]


class Quantity(NamedTuple):
    """A figure: its name, its unit, and whether more of it is better."""

    name: str
    unit: str = ""
    more: bool = False


#: Figures of any estimator; docs/learn/explore.md explains them.
FIGURES = (
    *map(Quantity, ("tolerance", "saturated", "cycles")),
    Quantity("us", "us"),
    Quantity("interval"),
    Quantity("rate", "Hz", more=True),
    *map(Quantity, ("lut", "ff", "dsp", "ram")),
    Quantity("clock", "MHz", more=True),
    Quantity("word", "bits"),
)
#: Figures that come from synthesis.
_OF_AREA = ("lut", "ff", "dsp", "ram", "clock")
#: What the clocks of rows are.
_ESTIMATED = "clock: an estimate from the netlist, not by ISE (docs/targets.md)"
_DEMAND = re.compile(
    r"([A-Za-z_][\w.]*)\s*(<=|>=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\d.eE+-])\s*(.*)"
)


def quantities(estimator: Estimator) -> list[Quantity]:
    """All figures that rows can have: errors of the outputs, then `FIGURES`.

    ``NAME`` is the largest error of an output from float64, ``NAME.rms`` its root mean square,
    ``NAME.truth`` the root mean square from truth.
    """
    units = {o.name: "" if o.unit in EXACT_UNITS else o.unit for o in estimator.outputs}
    angles = measure.ANGLE_NAMES.values() if gives_attitude(estimator) else ()
    floating = units | ({ATTITUDE: "deg"} if angles else {})
    true = units | dict.fromkeys(angles, "deg")
    return [
        *(Quantity(name + end, unit) for name, unit in floating.items() for end in ("", ".rms")),
        *(Quantity(f"{name}.truth", unit) for name, unit in true.items()),
        *(q for q in FIGURES if q.name not in units),
    ]


def quantity_of(name: str, known: Sequence[Quantity], where: str) -> Quantity:
    """A figure by name; raises InputError if there is none."""
    by_name = {quantity.name: quantity for quantity in known}
    require_choice(where, name, by_name, "choose one; docs/learn/explore.md has them all")
    return by_name[name]


class Demand(NamedTuple):
    """A limit for a figure, in the figure's unit; ``sign`` is one of ``< <= > >=``."""

    quantity: Quantity
    sign: str
    limit: float

    def meets(self, row: Row) -> bool:
        """Whether a row's figure is known and within the limit."""
        value = row.get(self.quantity.name)
        if value is None:
            return False
        if value == self.limit:
            return "=" in self.sign
        return bool(value < self.limit if "<" in self.sign else value > self.limit)

    def excess(self, row: Row) -> float:
        """Factor by which a row's figure misses the limit; 1 within it."""
        value = row.get(self.quantity.name)
        if self.meets(row):
            return 1.0
        if value is None:
            return math.inf
        larger, smaller = (value, self.limit) if "<" in self.sign else (self.limit, value)
        return larger / smaller if smaller > 0.0 else math.inf

    def __str__(self) -> str:
        return f"{self.quantity.name}{self.sign}{self.limit:.4g}{self.quantity.unit}"


def demands_of(text: str, known: Sequence[Quantity]) -> list[Demand]:
    """Demands from a text such as ``attitude<0.01deg, dsp<=1, us<5``, or InputError."""
    demands = []
    for part in filter(None, map(str.strip, text.split(","))):
        match = _DEMAND.fullmatch(part)
        if match is None:
            wanted = f"demands as {known[0].name}<0.01{known[0].unit}, dsp<=1"
            fix = "write NAME, one of < <= > >=, and a number"
            raise InputError.at("want", wanted=wanted, found=repr(part), fix=fix)
        quantity, limit = quantity_of(match[1], known, "want"), float(match[3])
        if match[4]:
            factor, offset = conversion(f"want, {part}", quantity.name, match[4], quantity.unit)
            limit = factor * limit + offset
        demands.append(Demand(quantity, match[2], limit))
    return demands


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
    or why `check` would refuse it. Returns ``rows``, one for each combination with its figures, and
    ``choice``. Raises InputError for unknown names, bad logs, and a limit of an unknown figure;
    ToolMissing without the C compiler, and without yosys if ``synth``.

    Parameters
    ----------
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
    jobs : int, optional
        Number of processes; by default one for each processor. An estimator that is given as an
        object runs in this process.
    again : bool
        Measure everything again, also stored rows.
    scheduler : str, optional
        Address of a Dask cluster that measures; its workers must see the same files.
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
    sources, arguments = measure.arguments_of(logs)
    worlds = tuple(s for s in sources if is_world(s))
    machines: Any = {"words": [*map(int, words)], "configs": configs, "targets": targets}
    cases = measure.cases_of(estimator, arguments, **machines)
    found = _first(cases)
    values = options.params_of(found, params)
    known = quantities(found)
    demands = demands_of(want, known)
    decides = demands[0].quantity if demands else None
    if least:
        decides = quantity_of(least, known, "least")
    asked = [demand.quantity.name for demand in demands] + [q.name for q in [decides] if q]
    for figure in _OF_AREA:
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
    exploration = measure.Exploration(
        tuple(log.first if log.path is None else str(log.path.absolute()) for log in read),
        worlds,
        tuple(sorted((values or {}).items())),
        steps,
        measure.digest_of([log.first for log in read]),
    )
    plans, tasks = measure.planned(exploration, cases, area=synth)
    shared = all(isinstance(x, str) for x in (estimator, *worlds))
    where: Any = {"jobs": jobs, "scheduler": scheduler, "shared": shared}
    complete(exploration, measure.measured, tasks, journal, say=say, batch=1, **where)
    rows = [_row(plan, journal.rows, exploration, clock) for plan in plans]
    result = _result(rows, known, demands, decides)
    page.write(_page(found.name, result))
    place = f"{folder / of}.html, {journal.path}"
    return replace(result, summary=f"{result.summary}\n{place}".strip())


def _first(cases: Sequence[measure.Case]) -> Estimator:
    """The estimator of the first case that has one; raises the first refusal if none has."""
    refusals = []
    for case in cases:
        try:
            return estimator_of(case.named)
        except InputError as error:
            refusals.append(error)
    raise refusals[0]


def _row(
    plan: measure.Plan, rows: Mapping[str, Row], exploration: measure.Exploration, clock_mhz: float
) -> dict[str, Any]:
    """A combination and its figures; ``reason`` says why check would refuse it."""
    case, of, data = plan.case, plan.case.named, dict[str, Any]()
    for key in plan.keys:
        data |= rows.get(key, {})
    refused = plan.refused or data.pop("refused", "")
    cycles, interval = data.get("cycles"), data.get("interval")
    if cycles is not None and interval is not None:
        data |= {"us": cycles / clock_mhz, "rate": 1e6 * clock_mhz / interval}
    return {
        "combination": case.name,
        "estimator": of if isinstance(of, str) else getattr(of, "__name__", "") or of.name,
        "word": case.word,
        "config": case.config,
        "target": case.target,
        **data,
        "good": bool(data.get("good")) and not refused,
        "reason": refused or data.get("reason", ""),
        "commands": () if plan.refused else case.commands(exploration),
    }


def _choice(table: Sequence[Row], demands: Sequence[Demand], least: Quantity) -> dict[str, Any]:
    """The row that check accepts, that meets all demands, and has least of a figure.

    If there is none, ``nearest`` is the accepted row that misses its worst limit by the smallest
    factor, and ``missed`` the demands that it misses.
    """
    accepted = [row for row in table if row["good"] and row.get(least.name) is not None]

    def cost(row: Row) -> tuple[float, ...]:
        value = row[least.name]
        return (-value if least.more else value, row.get("cycles", 0.0), row["word"])

    passing = [row for row in accepted if all(demand.meets(row) for demand in demands)]
    if passing or not accepted:
        best = min(passing, key=cost)["combination"] if passing else None
        return {"row": best, "nearest": None, "missed": []}
    nearest = min(accepted, key=lambda row: (max(d.excess(row) for d in demands), cost(row)))
    missed = [str(demand) for demand in demands if not demand.meets(nearest)]
    return {"row": None, "nearest": nearest["combination"], "missed": missed}


def _result(
    table: Sequence[Row],
    known: Sequence[Quantity],
    demands: Sequence[Demand],
    least: Quantity | None,
) -> Result:
    """The rows as a table, and the choice: ``least`` decides among those that meet the demands."""
    choice = None if least is None else _choice(table, demands, least)
    names = [q.name for q in known if any(row.get(q.name) is not None for row in table)]
    error = next((n for n in (ATTITUDE, "tolerance") if n in names), names[0] if names else "")
    columns = [error, "saturated", "cycles", "interval", "lut", "dsp", "ram", "clock"]
    columns += [d.quantity.name for d in demands] + ([] if least is None else [least.name])
    shown = [
        {"combination": row["combination"]}
        | {name: row.get(name) for name in columns}
        | {"good": row["good"], "reason": row["reason"] or None}
        for row in table
    ]
    lines, failures = list[str](), list[str]()
    by_name = {row["combination"]: row for row in table}
    if choice is None or least is None:
        failures += [] if any(row["good"] for row in table) else ["check accepts no combination"]
    elif choice["row"] is not None:
        figure = f"{by_name[choice['row']][least.name]:.4g} {least.unit}".rstrip()
        lines.append(f"choice, {least.name} {figure}: {choice['row']}")
    elif choice["nearest"] is not None:
        names = [re.split("[<>]", text)[0] for text in choice["missed"]]
        found = ", ".join(f"{n} is {by_name[choice['nearest']].get(n)}" for n in names)
        missed = ", ".join(choice["missed"])
        failures.append(f"no combination meets {missed}; nearest: {choice['nearest']}: {found}")
    else:
        failures.append("check accepts no combination that has these figures")
    if any(row.get("clock") for row in table):
        lines.append(_ESTIMATED)
    data = {"rows": table, "choice": choice}
    return Result(data, {"combinations": shown}, "\n".join(lines), failures=failures)


def _page(title: str, result: Result) -> str:
    rows = result["rows"]
    (name, shown), *_ = result.tables.items()
    error = list(shown[0])[1]
    cost = next((c for c in ("lut", "cycles") if any(row.get(c) for row in rows)), None)
    figures = [] if cost is None or not error else [("", _plot(rows, error, cost))]
    good = [row for row in rows if row["good"]]
    commands = [(row["combination"], command) for row in good for command in row["commands"]]
    return plotting.page_of(
        f"Exploration of {title}",
        [
            *result.summary.splitlines(),
            *(plotting.Verdict(text, good=False) for text in result.failures),
        ],
        [
            replace(plotting.section_of(name, shown), figures=figures),
            plotting.Section(title="Commands", columns=("combination", "command"), rows=commands),
        ],
    )


def _plot(rows: list[Row], error: str, cost: str) -> str:
    """SVG of the error over the cost, a curve for each machine; hollow where check fails."""
    series: dict[str, list[Row]] = {}
    for row in rows:
        if row.get(cost) is not None and (row.get(error) or 0.0) > 0.0:
            head = row["combination"].replace(f"{row['word']} bits, ", "")
            series.setdefault(head, []).append(row)
    with plotting.settings():
        figure, axes = plotting.figure_and_axes(3.6)
        for (head, of), colour in zip(series.items(), plotting.PALETTE * len(series), strict=False):
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
            plotting.legend(axes, 4)
        return plotting.svg(figure, "explore")
