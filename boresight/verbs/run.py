"""Run an estimator on a log; one row out per row in.

boresight run my_filter.py log.csv --on fixed -o out.csv  # the integers of the core
boresight run mekf log.csv --on float  # float64, compiled; out: mekf-float.csv
boresight run mekf log.csv --params tuned.json --param r_acc=0.02  # with other parameters
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from boresight.arguments import check_machine, check_optional
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.files import OutputFile
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
from boresight.sim.compare.difference import Difference, differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.level import Level
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.plotting import COLOUR, figure_and_axes, legend, settings, svg
from boresight.sim.records.feed import Feed, feeds
from boresight.sim.records.files import check_written, read_pieces, record_of, write_pieces
from boresight.sim.records.record import Column, Record
from boresight.sim.records.stream import ahead
from boresight.sim.rotations.accuracy import AttitudeRmse, attitude_rmse
from boresight.sim.rotations.outputs import attitude_of, euler_deg_of, status_of
from boresight.sim.worlds.loop import Loop, drive
from boresight.terminal import tell

__all__ = ["LEVELS", "RunAttitude", "RunResult", "run"]


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
    samples : int or None
        That count in it.
    """

    q: FloatArray = field(repr=False)
    euler_deg: FloatArray = field(repr=False)
    status: IntArray = field(repr=False)
    rmse_deg: AttitudeRmse | None
    samples: int | None = None

    @classmethod
    def joined(cls, parts: Sequence[RunAttitude]) -> RunAttitude:
        """Summaries of parts of a run, or its only part, as one."""
        first = parts[0]
        counted = [(p.samples, p.rmse_deg) for p in parts if p.samples and p.rmse_deg]
        if not counted or len(counted) == len(parts) == 1:
            return first
        samples = [n for n, _ in counted]
        mean = np.average([np.square(x) for _, x in counted], axis=0, weights=samples)
        return replace(first, rmse_deg=AttitudeRmse(*np.sqrt(mean).tolist()), samples=sum(samples))


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
    rows : int
        Of the log that were run.
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
    rows: int
    attitude: RunAttitude | None = None

    @property
    def good(self) -> bool:
        """The level's run is one."""
        return not self.fault

    def __len__(self) -> int:
        """Count the rows."""
        return self.rows

    @classmethod
    def joined(cls, parts: Sequence[RunResult]) -> RunResult:
        """Summaries of pieces of a log, or its only piece, as one."""
        first, last, rows = parts[0], parts[-1], [p.rows for p in parts]
        truth = zip(*(p.truth for p in parts), strict=True)
        attitudes = [p.attitude for p in parts if p.attitude is not None]
        return replace(
            first,
            truth=tuple(Difference.joined(d, rows) for d in truth),
            warnings=tuple(dict.fromkeys(text for p in parts for text in p.warnings)),
            clamped=last.clamped,
            fault=next((p.fault for p in parts if p.fault), ""),
            rows=sum(rows),
            attitude=RunAttitude.joined(attitudes) if attitudes else None,
        )

    def record(self) -> Record:
        """The outputs as a log, half turns in degrees."""
        return _record(self.estimator, self.units, self.t, self.outputs)

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
    rows: Annotated[int | None, Option(hidden=True)] = None,
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
        interpreter, in segments whose first states come from the C: it needs a C compiler), c or
        rtl (Verilator).
    steps : int, optional
        Leading samples of the log.
    output : path, optional
        Log (its kind by the suffix, else CSV) with one row per input row: ``t``, then every output
        with its unit in the header; half turns in degrees. The command line writes
        ESTIMATOR-LEVEL.csv by default, with --json none.
    rows : int, optional
        Read, run and write a file in pieces of so many rows, for a log that memory does not hold;
        the result has no rows then, and no ``truth`` of an attitude whose error it gives. By
        default all at once.

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
    require_choice("on", on, LEVELS)
    check_machine(config, word)
    check_optional("steps", steps, 1)
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
    if output is not None:
        check_written(output)
    target = None if output is None else OutputFile(output, inputs=inputs)
    parts, units = list[RunResult](), {o.name: o.unit for o in estimator.outputs}

    def runs(level: Level) -> Iterator[tuple[Feed, Loop]]:
        """The level on the log, piece by piece, with what it ran on."""
        pieces = _pieces(log, steps, rows)
        anew = True
        for columns in feeds(estimator, pieces if rows is None else ahead(pieces)):
            (loop,) = drive(columns, level, anew=anew)
            anew = False
            yield columns, loop

    def written(level: Level) -> Iterator[Record]:
        """Outputs, piece by piece; what the result needs of each goes to ``parts``."""
        for columns, loop in runs(level) if rows is None else ahead(runs(level)):
            parts.append(_result(estimator, on, columns, loop, whole=rows is None))
            start = sum(part.rows for part in parts[:-1])
            yield _record(of, units, columns.t, loop.outputs, start)

    with make_level(on, build) as level:
        level.traced = False
        if target is None:
            deque(written(level), maxlen=0)
            return RunResult.joined(parts)
        with target.opened() as file:
            write_pieces(str(output), file, written(level))
        return RunResult.joined(parts)


def _result(estimator: Estimator, on: str, columns: Feed, loop: Loop, *, whole: bool) -> RunResult:
    """What is said of a log, or of a piece of it: no rows then, and of an attitude its error."""
    attitude, truth = _attitude(columns, loop.outputs, whole), list[Difference]()
    if whole or attitude is None or attitude.samples is None:
        truth = differences(
            estimator.outputs, loop.outputs, columns.truth, judged=False, curves=whole
        )
    return RunResult(
        estimator=estimator.name,
        on=on,
        log=columns.record.name,
        t=columns.t if whole else None,
        outputs=loop.outputs if whole else {},
        units={o.name: o.unit for o in estimator.outputs},
        truth=tuple(truth),
        warnings=tuple(columns.warnings),
        clamped=dict(columns.clamped),
        fault=loop.run.fault,
        rows=len(columns),
        attitude=attitude,
    )


#: Rows of a log that are in memory at once where nothing but a summary is asked for.
_ROWS = 1 << 15


def _pieces(log: Any, steps: int | None, rows: int | None) -> Iterator[Record]:
    """The leading rows of a log, in pieces or as one."""
    if rows is None or not isinstance(log, str | Path):
        yield record_of(log).head(steps)
        return
    done = 0
    for piece in read_pieces(log, rows):
        yield piece if steps is None else piece.head(steps - done)
        done += len(piece)
        if steps is not None and done >= steps:
            return


def _record(
    name: str,
    units: Mapping[str, str],
    t: FloatArray | None,
    outputs: Mapping[str, FloatArray],
    start: int = 0,
) -> Record:
    """Outputs of the steps from ``start`` on as a log; InputError if one is infinite."""
    infinite = {o: int(np.argmax(at)) for o, v in outputs.items() if (at := np.isinf(v)).any()}
    if infinite:
        output = min(infinite, key=infinite.__getitem__)
        step = start + infinite[output]
        raise InputError.at(
            f"{name}, output {output}, step {step}",
            wanted="a finite value",
            found="an infinite one: the estimator diverges",
            fix=f"--steps {step} gives the rows before it" if step else "correct the estimator",
        )
    columns = {} if t is None else {"t": Column(t, "s")}
    for output, values in outputs.items():
        half_turns = units[output] == "ht"
        columns[output] = Column(
            values * (180.0 if half_turns else 1.0), "deg" if half_turns else units[output] or None
        )
    return Record(name, columns).of_numbers()


def _attitude(columns: Feed, outputs: Mapping[str, FloatArray], whole: bool) -> RunAttitude | None:
    """What is said of an attitude besides; None if the outputs are none."""
    if not {*QUATERNION, "heading", "pitch", "roll", "status"} <= set(outputs):
        return None
    q, rmse, samples = attitude_of(outputs), None, None
    if all(name in columns.truth for name in QUATERNION):
        reference = attitude_of(columns.truth)
        samples = int(np.count_nonzero(~np.isnan(reference).any(axis=1) & columns.counts))
        rmse = attitude_rmse(q, reference, columns.counts) if samples else None
    if not whole:
        q, outputs = np.zeros((0, 4)), {n: np.zeros(0) for n in outputs}
    return RunAttitude(q, euler_deg_of(outputs), status_of(outputs), rmse, samples)


def call(arguments: Arguments) -> Outcome:
    """Run, and say what is odd and where the rows are."""
    typed = arguments.typed
    if "output" not in typed and not arguments.json:
        typed["output"] = f"{find_estimator(typed['name']).name}-{typed.get('on', 'fixed')}.csv"
    # The RTL replays a log from a reset on; all others go on from piece to piece.
    whole = arguments.json or typed.get("on") == "rtl"
    result = arguments.call(run, rows=None if whole else _ROWS)
    for text in result.warnings:
        tell(f"warning: {text}")
    code, data, text = outcome(result)
    if result.good:
        text = text.replace(" rows", f" rows to {typed.get('output')}", 1)
    return code, data, text


VERB = Verb(run, call=call)
