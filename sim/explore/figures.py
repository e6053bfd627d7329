"""The table of an exploration: a row for each combination, its figures by name."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from boresight.model.declarations import ATTITUDE, EXACT_UNITS
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named, profiles_now
from boresight.model.tolerances import tolerances_now
from boresight.sim.accuracy.figures import gives_attitude
from boresight.sim.explore.cases import Planned
from boresight.sim.explore.measure import ATTITUDES, Exploration
from boresight.sim.records.selection import selection

__all__ = [
    "ESTIMATED",
    "FIGURES",
    "OF_AREA",
    "ErrorFigures",
    "Explored",
    "Quantity",
    "explored",
    "quantities",
]


@dataclass(frozen=True)
class Quantity:
    """A figure of a row: name, title, unit, and whether more of it is better."""

    name: str
    title: str
    unit: str = ""
    more: bool = False


#: Figures of any estimator; those of its outputs come before them.
FIGURES = (
    Quantity("tolerance", "largest error from float64, over the tolerance"),
    Quantity("saturated", "updates that saturated"),
    Quantity("cycles", "sample in to last urgent output", "cycles"),
    Quantity("us", "sample in to last urgent output, at the chosen clock", "us"),
    Quantity("interval", "next sample after", "cycles"),
    Quantity("rate", "samples a second, at the chosen clock", "Hz", more=True),
    Quantity("lut", "LUT"),
    Quantity("ff", "flip-flops"),
    Quantity("dsp", "multiplier blocks"),
    Quantity("ram", "block RAM, in the blocks of the part"),
    Quantity("clock", "clock: routed, or of a Spartan-6 an estimate", "MHz", more=True),
    Quantity("own_us", "sample in to last urgent output, at its own clock", "us"),
    Quantity("multiplications", "multiplications an update"),
    Quantity("accesses", "words read and written an update"),
    Quantity("toggles", "nets that change an update, as the netlist is simulated"),
    Quantity("word", "word width", "bits"),
)
#: How far estimated clocks are off: docs/targets.md.
ESTIMATED = (
    "clock: estimated from the netlist; on 12 cores for ECP5 the method was 1 to 41 % below the "
    "routed clock"
)
#: Those that synthesis or routing gives.
OF_AREA = ("lut", "ff", "dsp", "ram", "clock", "own_us")
_NAMES = {quantity.name for quantity in FIGURES}
#: Suffixes of the names of errors from truth: largest and root mean square.
_TRUTH = (".truth", ".truth_rms")


@dataclass(frozen=True)
class ErrorFigures:
    """Errors of an output, in its unit; None for one that is not finite.

    Attributes
    ----------
    unit : str
    largest, rms : float or None
    tolerance : float or None
        Largest error that its author accepts; None: it is not judged.
    """

    unit: str
    largest: float | None
    rms: float | None
    tolerance: float | None = None


@dataclass(frozen=True)
class Explored:
    """A row: one combination. Unknown figures, or those not measured yet, are None.

    Attributes
    ----------
    estimator : str
        With the arguments of its constructor.
    arguments : mapping of str to str
        These, as Python writes them.
    word : int
        Bits.
    config, target : str
    refused : str
        Why it cannot be built or measured; else empty.
    errors : mapping of str to ErrorFigures
        Of each output, and the angle between attitudes: fixed point from float64.
    truth : mapping of str to ErrorFigures
        Fixed point from truth, where a log has one.
    good : bool or None
        Every output within its tolerance, and nothing saturated.
    saturated : int or None
        Updates.
    cycles, interval : int or None
        Sample in to the last urgent output; to the next sample.
    latencies : mapping of str to int
        Sample in to each output, cycles.
    us, rate : float or None
        ``cycles`` in microseconds and samples a second, at the chosen clock.
    multiplications, accesses : int or None
        An update: multiplications, words read from and written to the register file.
    toggles : float or None
        Nets of the netlist that change in an update, before each edge of the clock.
    lut, ff, dsp : int or None
    ram : float or None
        Block RAM in the blocks of the part; halves are RAMB8 of a Spartan-6.
    clock : float or None
        MHz.
    clock_is : str
        ``estimate`` or ``routed``.
    fits : bool or None
        Whether the target has as much of everything.
    commands : tuple of str
        Command lines that make and check it.
    """

    estimator: str
    arguments: Mapping[str, str]
    word: int
    config: str
    target: str
    refused: str = ""
    errors: Mapping[str, ErrorFigures] = field(default_factory=dict)
    truth: Mapping[str, ErrorFigures] = field(default_factory=dict)
    good: bool | None = None
    saturated: int | None = None
    cycles: int | None = None
    interval: int | None = None
    latencies: Mapping[str, int] = field(default_factory=dict)
    us: float | None = None
    rate: float | None = None
    multiplications: int | None = None
    accesses: int | None = None
    toggles: float | None = None
    lut: int | None = None
    ff: int | None = None
    dsp: int | None = None
    ram: float | None = None
    clock: float | None = None
    clock_is: str = ""
    fits: bool | None = None
    commands: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name that distinguishes it from other combinations."""
        arguments = [f"{key}={value}" for key, value in self.arguments.items()]
        return ", ".join([*arguments, f"{self.word} bits", self.config, self.target])

    @property
    def own_us(self) -> float | None:
        """``cycles`` in microseconds at the clock of the core on its target."""
        return None if self.cycles is None or not self.clock else self.cycles / self.clock

    @property
    def tolerance(self) -> float | None:
        """Largest error over its tolerance, of the outputs that are judged."""
        shares = [
            float("inf") if e.largest is None else e.largest / e.tolerance
            for e in self.errors.values()
            if e.tolerance
        ]
        return max(shares, default=None)

    @property
    def figures(self) -> dict[str, float]:
        """The known figures by name; infinity for an error that is not finite."""
        out: dict[str, float] = {}
        for names, errors in ((("", ".rms"), self.errors), (_TRUTH, self.truth)):
            for output, e in errors.items():
                for end, value in zip(names, (e.largest, e.rms), strict=True):
                    out[f"{_figure_name(output)}{end}"] = float("inf") if value is None else value
        values = ((q.name, getattr(self, q.name)) for q in FIGURES)
        return out | {name: value for name, value in values if value is not None}


def _figure_name(output: str) -> str:
    """Name of an output's figures, distinct from those of all estimators."""
    return f"output.{output}" if output in _NAMES else output


def quantities(estimator: Estimator) -> list[Quantity]:
    """All figures that rows can have: errors of the outputs, then `FIGURES`."""
    units = {o.name: "" if o.unit in EXACT_UNITS else o.unit for o in estimator.outputs}
    angles = ATTITUDES.values() if gives_attitude(estimator) else ()
    floating = units | ({ATTITUDE: "deg"} if angles else {})
    truth = units | dict.fromkeys(angles, "deg")
    out = [
        Quantity(f"{_figure_name(name)}{end}", f"{name}: {kind} error from {base}", unit)
        for base, by_name, ends in (("float64", floating, ("", ".rms")), ("truth", truth, _TRUTH))
        for name, unit in by_name.items()
        for end, kind in zip(ends, ("largest", "rms of the"), strict=True)
    ]
    return [*out, *FIGURES]


def explored(
    plan: Planned,
    rows: Mapping[str, Mapping[str, Any]],
    exploration: Exploration,
    *,
    clock_mhz: float,
) -> Explored:
    """The row of a combination from its measurements so far.

    Parameters
    ----------
    plan : Planned
    rows : mapping
        Of the journal, by key.
    exploration : Exploration
        For the command lines.
    clock_mhz : float
        For times.
    """
    case = plan.case
    plan_rows = [rows.get(key, {}) for key in plan.keys.values()]
    data: dict[str, Any] = {name: value for row in plan_rows for name, value in row.items()}
    refused = plan.refused or next((row["refused"] for row in plan_rows if row.get("refused")), "")
    errors = {name: _error(e) for name, e in data.get("errors", {}).items()}
    good = None
    if errors:
        good = all(e["good"] for e in data["errors"].values()) and not data["saturated"]
    cycles, interval = data.get("cycles"), data.get("interval")
    names = (
        *("saturated", "multiplications", "accesses", "toggles"),
        *("lut", "ff", "dsp", "ram", "clock"),
    )
    return Explored(
        estimator=_text(case.estimator, case.arguments),
        arguments=dict(case.arguments),
        word=case.word,
        config=case.config,
        target=case.target,
        refused=refused,
        errors=errors,
        truth={name: _error(e) for name, e in data.get("truth", {}).items()},
        good=good,
        cycles=cycles,
        interval=interval,
        latencies=data.get("latencies", {}),
        us=None if cycles is None else cycles / clock_mhz,
        rate=None if interval is None else 1e6 * clock_mhz / interval,
        fits=data.get("fits"),
        commands=_commands(plan, exploration),
        clock_is=data.get("clock_is", ""),
        **{name: data.get(name) for name in names},
    )


def _error(data: Mapping[str, Any]) -> ErrorFigures:
    return ErrorFigures(data["unit"], data["largest"], data["rms"], data.get("tolerance"))


def _text(estimator: Named, arguments: Sequence[tuple[str, str]]) -> str:
    """Text of the estimator with its arguments."""
    if isinstance(estimator, str):
        name = estimator
    else:
        name = estimator.__name__ if isinstance(estimator, type) else estimator.name
    text = ", ".join(f"{key}={value}" for key, value in arguments)
    return f"{name}({text})" if text else name


def _commands(plan: Planned, exploration: Exploration) -> tuple[str, ...]:
    case = plan.case
    if plan.refused or not isinstance(case.named, str):
        return ()
    machine = f"--word {case.word} --config {case.config}"
    synthesis = f"--route --seeds {exploration.seeds}" if "routed" in plan.keys else "--synth"
    machine += "".join(f" --param {name}={value!r}" for name, value in exploration.params)
    machine += f" --urgent {exploration.urgent}" if exploration.urgent else ""
    machine += "".join(f" --tolerance {shlex.quote(text)}" for text in tolerances_now())
    files = profiles_now()
    machine += "".join(f" --profile {shlex.quote(file)}" for file in files or ())
    machine += " --no-profile" if files == () else ""
    logs = " ".join(shlex.quote(log) for log in exploration.logs if isinstance(log, str))
    name = shlex.quote(case.named)
    rows = selection().options + (f" --steps {exploration.steps}" if exploration.steps else "")
    return (
        f"boresight compile {name} {machine} --target {case.target} {synthesis} -o build",
        *([f"boresight check {name} {logs} {machine}{rows}"] if logs else []),
        *([f"boresight report {name} {logs} {machine}{rows} -o build"] if logs else []),
    )
