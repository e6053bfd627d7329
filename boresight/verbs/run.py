"""Run an estimator on a log; one row out per row in.

boresight run my_filter.py log.csv --on fixed -o out.csv  # the integers of the core
boresight run mekf log.csv --on float  # float64, compiled; out: mekf-float.csv
boresight run mekf log.csv --params tuned.json --param r_acc=0.02  # with other parameters
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from boresight.arguments import check_choice, check_machine, check_number
from boresight.disk.output import OutputFile
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import (
    Arguments,
    Config,
    EstimatorName,
    Option,
    Outcome,
    Params,
    Verb,
    Word,
    outcome,
)
from boresight.sim.answer import Answer, JsonObject
from boresight.sim.attitude.accuracy import AttitudeRmse, attitude_rmse
from boresight.sim.attitude.outputs import attitude_of, euler_deg_of, status_of
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.files import content_of, record_of
from boresight.sim.records.record import Column, Record
from boresight.sim.worlds.loop import drive
from boresight.terminal import tell

__all__ = ["LEVELS", "RunAttitude", "RunResult", "run"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RunAttitude:
    """What `run` says of an attitude besides its outputs.

    Attributes
    ----------
    q : float64 (n, 4)
        Quaternions.
    euler_deg : float64 (n, 3)
        Heading, pitch, roll.
    status : int64 (n,)
        Status words.
    rmse_deg : AttitudeRmse or None
        ``total``, ``heading``, ``inclination`` against the log's reference, if it has one.
    """

    q: FloatArray = field(repr=False)
    euler_deg: FloatArray = field(repr=False)
    status: npt.NDArray[np.int64] = field(repr=False)
    rmse_deg: AttitudeRmse | None


@dataclass(frozen=True, eq=False)
class RunResult(Answer):
    """What `run` gives; in a notebook the outputs as plots, unit by unit.

    Attributes
    ----------
    estimator, on, log : str
        Names of the estimator, the level and the log.
    t : float64 (n,) or None
        Times in seconds, where the log has them.
    outputs : mapping of str to float64 (n,)
        By name, in their units.
    units : mapping of str to str
        Unit of each output.
    truth : tuple of Difference
        Outputs from the log's truths.
    warnings : tuple of str
        What is odd about the log.
    clamped : mapping of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    fault : str
        Why the level's run is none, where two of its forms or its cycles and the schedule disagree;
        empty as a rule.
    attitude : RunAttitude or None
        Of an attitude filter; in `to_json` its fields stand beside the others.
    """

    estimator: str
    on: str
    log: str
    t: FloatArray | None = field(repr=False)
    outputs: Mapping[str, FloatArray] = field(repr=False)
    units: Mapping[str, str]
    truth: tuple[Difference, ...]
    warnings: tuple[str, ...]
    clamped: Mapping[str, int]
    fault: str
    attitude: RunAttitude | None = None

    @property
    def good(self) -> bool:
        """The level's run is one."""
        return not self.fault

    def __len__(self) -> int:
        """Count the rows."""
        return len(next(iter(self.outputs.values())))

    def record(self) -> Record:
        """The outputs as a log, half turns in degrees."""
        columns = {} if self.t is None else {"t": Column(self.t, "s")}
        for name, values in self.outputs.items():
            half_turns = self.units[name] == "ht"
            columns[name] = Column(
                values * (180.0 if half_turns else 1.0),
                "deg" if half_turns else self.units[name] or None,
            )
        return Record(self.estimator, columns)

    def to_json(self) -> JsonObject:
        """Plain data; fields of an attitude beside the others."""
        data = super().to_json()
        more = data.pop("attitude")
        return data | more if isinstance(more, dict) else data

    def __str__(self) -> str:
        if self.fault:
            return f"FAILED {self.on}: {self.fault}"
        text = f"{len(self)} rows"
        if self.attitude is not None and self.attitude.rmse_deg is not None:
            return f"{text}, RMSE against the log's reference, deg: " + ", ".join(
                f"{k} {v:.3f}" for k, v in self.attitude.rmse_deg._asdict().items()
            )
        if known := [d for d in self.truth if np.isfinite(d.rms)]:
            text += ", RMSE against the log's truth: " + ", ".join(
                f"{d.output} {d.rms:.4g} {d.unit}".rstrip() for d in known
            )
        return text

    def _repr_html_(self) -> str:
        by_unit: dict[str, list[str]] = {}
        for name, unit in self.units.items():
            by_unit.setdefault(unit, []).append(name)
        across = np.arange(len(self)) if self.t is None else self.t
        colours = list(dict.fromkeys(COLOUR.values()))  # each once
        with settings():
            figure, all_axes = figure_and_axes(
                1.8 * len(by_unit) + 0.4, len(by_unit), sharex=True, squeeze=False
            )
            for axes, (unit, names) in zip(all_axes[:, 0], by_unit.items(), strict=True):
                for k, name in enumerate(names):
                    colour = colours[k % len(colours)]
                    axes.plot(across, self.outputs[name], label=name, color=colour)
                axes.set_ylabel(unit)
                legend(axes, len(names))
            axes.set_xlabel("row" if self.t is None else "t, s")
            drawn = svg(figure, self.estimator)
        return f"<p>{escape(self.estimator)} on {self.on}: {escape(str(self))}</p>\n{drawn}"


def run(
    name: EstimatorName,
    log: Annotated[Any, Option(metavar="LOG")],
    *,
    on: str = "fixed",
    config: Config = "small",
    word: Word = 32,
    params: Params = None,
    steps: int | None = None,
    output: Annotated[str | Path | None, Option(("-o", "--output"), "OUT.csv")] = None,
) -> RunResult:
    """Run an estimator on a log.

    Parameters
    ----------
    name : str, class or Estimator
        Name, ``file.py:Class``, class or object.
    log : path, mapping of arrays, table or Record
        Columns by input name (`Record.of`).
    on : str
        Level: float (compiled float64), numpy (the same, as written), fixed (the integer
        interpreter), c or rtl (Verilator).
    steps : int, optional
        Leading samples of the log.
    output : path, optional
        Log (its kind by the suffix, else CSV) with one row per input row: ``t``, then every output
        with its unit in the header; half turns in degrees. The command line writes
        ESTIMATOR-LEVEL.csv by default, with --json none.

    Returns
    -------
    RunResult
        Outputs by name, differences from the log's truths, warnings.

    Raises
    ------
    InputError
        Unknown estimator or level, bad log, output that cannot be written.
    """
    estimator = find_estimator(name)
    check_choice("on", on, LEVELS)
    check_machine(config, word)
    if steps is not None:
        check_number("steps", steps, 1)
    build = Build(estimator, config=config, word=word, params=[params])
    inputs = [log] if isinstance(log, str | Path) else []
    of = estimator.name
    if output is not None and any(o.name == "t" for o in estimator.outputs):
        raise InputError.at(
            f"{of}, output t",
            wanted="another name for what is written",
            found="t, the column of the times",
            fix="rename the output, or leave -o out",
        )
    target = None if output is None else OutputFile(output, "run", of=of, inputs=inputs)
    record = record_of(log).head(steps)
    columns = feed(estimator, record)
    with make_level(on, build) as level:
        (loop,) = drive(columns, level)
    outputs = loop.outputs
    result = RunResult(
        estimator=estimator.name,
        on=on,
        log=record.name,
        t=columns.t,
        outputs=outputs,
        units={o.name: o.unit for o in estimator.outputs},
        truth=tuple(differences(estimator.outputs, outputs, columns.truth, judged=False)),
        warnings=tuple(columns.warnings),
        clamped=columns.clamped,
        fault=loop.run.fault,
        attitude=_attitude(columns, outputs),
    )
    if target is not None:
        target.write(content_of(str(output), result.record()))
    return result


def _attitude(columns: Feed, outputs: Mapping[str, FloatArray]) -> RunAttitude | None:
    """What is said of an attitude besides; None if the outputs are none."""
    if not {*QUATERNION, "heading", "pitch", "roll", "status"} <= set(outputs):
        return None
    q, rmse = attitude_of(outputs), None
    if all(name in columns.truth for name in QUATERNION):
        rmse = attitude_rmse(q, attitude_of(columns.truth), columns.counts)
    return RunAttitude(q, euler_deg_of(outputs), status_of(outputs), rmse)


def call(arguments: Arguments) -> Outcome:
    """Run, and say what is odd and where the rows are."""
    typed = arguments.typed
    if "output" not in typed and not arguments.json:
        typed["output"] = f"{find_estimator(typed['name']).name}-{typed.get('on', 'fixed')}.csv"
    result = arguments.call(run)
    for text in result.warnings:
        tell(f"warning: {text}")
    code, data, text = outcome(result)
    if result.good:
        text = text.replace(" rows", f" rows to {typed.get('output')}", 1)
    return code, data, text


VERB = Verb(run, call=call)
