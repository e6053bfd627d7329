"""The table of an exploration: figures of each combination, demands on them, and the choice."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from boresight.model.declarations import ATTITUDE, EXACT_UNITS
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator
from boresight.model.settings import CURRENT
from boresight.model.units import conversion
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.explore.measure import ANGLE_NAMES, Case, Exploration, Plan
from boresight.sim.records.selection import selection
from boresight.sim.result import Result, Row


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
OF_AREA = ("lut", "ff", "dsp", "ram", "clock")
#: What the clocks of rows are.
ESTIMATED = "clock: an estimate from the netlist, not by ISE (docs/targets.md)"
_DEMAND = re.compile(
    r"([A-Za-z_][\w.]*)\s*(<=|>=|<|>)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\d.eE+-])\s*(.*)"
)


def quantities(estimator: Estimator) -> list[Quantity]:
    """All figures that rows can have: errors of the outputs, then `FIGURES`.

    ``NAME`` is the largest error of an output from float64, ``NAME.rms`` its root mean square,
    ``NAME.truth`` the root mean square from truth.
    """
    units = {o.name: "" if o.unit in EXACT_UNITS else o.unit for o in estimator.outputs}
    angles = ANGLE_NAMES.values() if gives_attitude(estimator) else ()
    floating = units | ({ATTITUDE: "deg"} if angles else {})
    return [
        *(Quantity(name + end, unit) for name, unit in floating.items() for end in ("", ".rms")),
        *(
            Quantity(f"{n}.truth", unit)
            for n, unit in (units | dict.fromkeys(angles, "deg")).items()
        ),
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
            raise InputError.at(
                "want",
                wanted=f"demands as {known[0].name}<0.01{known[0].unit}, dsp<=1",
                found=repr(part),
                fix="write NAME, one of < <= > >=, and a number",
            )
        quantity, limit = quantity_of(match[1], known, "want"), float(match[3])
        if match[4]:
            factor, offset = conversion(f"want, {part}", quantity.name, match[4], quantity.unit)
            limit = factor * limit + offset
        demands.append(Demand(quantity, match[2], limit))
    return demands


def result_of(
    plans: Sequence[Plan],
    rows: Mapping[str, Row],
    exploration: Exploration,
    known: Sequence[Quantity],
    demands: Sequence[Demand],
    *,
    least: Quantity | None,
    clock_mhz: float,
) -> Result:
    """The result of an exploration, with a row for each combination and the choice.

    ``rows`` are the journal's; ``least`` decides among the combinations that meet the demands.
    """
    table = [_row(plan, rows, exploration, clock_mhz) for plan in plans]
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
    lines, failures = [], []
    if choice is not None and choice["row"] is not None:
        assert least is not None
        best = next(row for row in table if row["combination"] == choice["row"])
        figure = f"{best[least.name]:.4g} {least.unit}".rstrip()
        lines.append(f"choice, {least.name} {figure}: {choice['row']}")
    elif choice is not None and choice["nearest"] is not None:
        near = next(row for row in table if row["combination"] == choice["nearest"])
        names = [re.split("[<>]", text)[0] for text in choice["missed"]]
        found = ", ".join(f"{n} is {near.get(n)}" for n in names)
        missed = ", ".join(choice["missed"])
        failures.append(f"no combination meets {missed}; nearest: {choice['nearest']}: {found}")
    elif choice is not None:
        failures.append("check accepts no combination that has these figures")
    elif not any(row["good"] for row in table):
        failures.append("check accepts no combination")
    if any(row.get("clock") for row in table):
        lines.append(ESTIMATED)
    data = {"rows": table, "choice": choice}
    return Result(data, {"combinations": shown}, "\n".join(lines), failures=failures)


def _row(
    plan: Plan, rows: Mapping[str, Row], exploration: Exploration, clock_mhz: float
) -> dict[str, Any]:
    """A combination and its figures; ``reason`` says why check would refuse it."""
    case = plan.case
    parts = [rows.get(key, {}) for key in plan.keys]
    data = {name: value for part in parts for name, value in part.items()}
    refused = plan.refused or data.pop("refused", "")
    cycles, interval = data.get("cycles"), data.get("interval")
    if cycles is not None and interval is not None:
        data |= {"us": cycles / clock_mhz, "rate": 1e6 * clock_mhz / interval}
    return {
        "combination": case.name,
        "estimator": _estimator(case),
        "word": case.word,
        "config": case.config,
        "target": case.target,
        **data,
        "good": bool(data.get("good")) and not refused,
        "reason": refused or data.get("reason", ""),
        "commands": () if plan.refused else _commands(plan.case, exploration),
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


def _estimator(case: Case) -> str:
    """Text of the estimator with its arguments."""
    of = case.named
    return of if isinstance(of, str) else of.__name__ if isinstance(of, type) else of.name


def _commands(case: Case, exploration: Exploration) -> tuple[str, ...]:
    """Command lines that make and check a combination; none for an object."""
    if not isinstance(case.named, str):
        return ()
    name = shlex.quote(case.named)
    options = f"--word {case.word} --config {case.config}"
    options += "".join(f" --param {n}={value!r}" for n, value in exploration.params)
    options += CURRENT.get().options
    texts = [x for x in (*exploration.logs, *exploration.worlds) if isinstance(x, str)]
    rows = selection().options + (f" --steps {exploration.steps}" if exploration.steps else "")
    check = f"boresight check {name} {shlex.join(texts)} {options}{rows}"
    compile_ = f"boresight compile {name} {options} --target {case.target} -o build"
    return (compile_, check) if texts else (compile_,)
