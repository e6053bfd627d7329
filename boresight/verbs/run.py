"""`boresight run`: one estimator on one log, on one level."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.arguments import check_choice, check_machine, check_number
from boresight.disk.output import OutputFile
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Outcome, model_options, params_of
from boresight.sim.attitude.accuracy import attitude_rmse
from boresight.sim.attitude.outputs import attitude_of, euler_deg_of, status_of
from boresight.sim.compare.difference import differences
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.files import content_of, record_of
from boresight.sim.records.record import Column, Record
from boresight.terminal import tell

__all__ = ["LEVELS", "add_arguments", "call", "run"]

FloatArray = npt.NDArray[np.float64]


def run(
    name: Named,
    log: Any,
    *,
    on: str = "fixed",
    config: str = "small",
    word: int = 32,
    params: Mapping[str, float] | None = None,
    steps: int | None = None,
    output: str | Path | None = None,
) -> dict[str, Any]:
    """Run an estimator on a log.

    Parameters
    ----------
    name : str, class or Estimator
        Name, ``file.py:Class``, class or object.
    log : path, mapping of arrays, table or Record
        Columns by input name; see `sim.records.record.Record.of`.
    on : str
        One of `LEVELS`: "float" (compiled float64), "numpy" (the same, as written), "fixed" (the
        integer interpreter), "c" or "rtl" (Verilator).
    output : path, optional
        Log (CSV, or ``.npz`` by its name) with one row per input row: ``t``, then every output with
        its unit in the header; half turns in degrees.

    Returns
    -------
    dict
        ``t`` (n,) in seconds or None, ``outputs`` (arrays (n,) by name, in their units), ``units``,
        ``truth`` (differences from the log's truths), ``warnings``, ``clamped``; of an attitude
        also ``q`` (n, 4), ``euler_deg`` (n, 3: heading, pitch, roll), ``status`` (n,) and
        ``rmse_deg`` against the log's reference, or None. ``fault`` says why the level's run is
        none, where two of its forms or its cycles and the schedule disagree; empty as a rule.

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
    given = feed(estimator, record)
    with make_level(on, build) as level:
        made = level.run(given.inputs)
    outputs = made.outputs
    if target is not None:
        target.write(content_of(str(output), _log_of(estimator, given.t, outputs)))
    return {
        "estimator": estimator.name,
        "on": on,
        "log": record.name,
        "t": given.t,
        "outputs": outputs,
        "units": {o.name: o.unit for o in estimator.outputs},
        "truth": [
            d.to_json() for d in differences(estimator.outputs, outputs, given.truth, judged=False)
        ],
        "warnings": list(given.warnings),
        "clamped": given.clamped,
        "fault": made.fault,
        **_attitude(given, outputs),
    }


def _attitude(given: Feed, outputs: Mapping[str, FloatArray]) -> dict[str, Any]:
    """What is said of an attitude besides."""
    if not {*QUATERNION, "heading", "pitch", "roll", "status"} <= set(outputs):
        return {}
    q, rmse = attitude_of(outputs), None
    if all(name in given.truth for name in QUATERNION):
        rmse = attitude_rmse(q, attitude_of(given.truth), given.counts)._asdict()
    return {
        "q": q,
        "euler_deg": euler_deg_of(outputs),
        "status": status_of(outputs),
        "rmse_deg": rmse,
    }


def _log_of(
    estimator: Estimator, t: FloatArray | None, outputs: Mapping[str, FloatArray]
) -> Record:
    """The outputs as a log."""
    columns = {} if t is None else {"t": Column(t, "s")}
    for o in estimator.outputs:
        half_turns = o.unit == "ht"
        values = outputs[o.name] * (180.0 if half_turns else 1.0)
        columns[o.name] = Column(values, "deg" if half_turns else o.unit or None)
    return Record(estimator.name, columns)


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("log")
    parser.add_argument("--on", default="fixed", help=f"one of {', '.join(LEVELS)}")
    model_options(parser)
    parser.add_argument("--steps", type=int)
    parser.add_argument("-o", "--output", metavar="OUT.csv")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    if args.output is None and not args.json:
        args.output = f"{find_estimator(args.estimator).name}-{args.on}.csv"
    data = run(
        args.estimator,
        args.log,
        on=args.on,
        config=args.config,
        word=args.word,
        params=params_of(args, [args.estimator]),
        steps=args.steps,
        output=args.output,
    )
    for text in data["warnings"]:
        tell(f"warning: {text}")
    if data["fault"]:
        return 1, _plain(data), f"FAILED {args.on}: {data['fault']}"
    rows = len(next(iter(data["outputs"].values())))
    text = f"{rows} rows to {args.output}"
    if data.get("rmse_deg"):
        text += ", RMSE against the log's reference, deg: " + ", ".join(
            f"{k} {v:.3f}" for k, v in data["rmse_deg"].items()
        )
    elif known := [d for d in data["truth"] if d["rms"] is not None]:
        text += ", RMSE against the log's truth: " + ", ".join(
            f"{d['output']} {d['rms']:.4g} {d['unit']}".rstrip() for d in known
        )
    return 0, _plain(data), text


def _plain(data: Any) -> Any:
    """Arrays as lists; what JSON has no number for is None."""
    if isinstance(data, dict):
        return {k: _plain(v) for k, v in data.items()}
    if isinstance(data, np.ndarray):
        plain = data.astype(object)
        plain[~np.isfinite(data)] = None
        return plain.tolist()
    return data
