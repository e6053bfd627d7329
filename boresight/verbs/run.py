"""`boresight run`: one estimator on one log, on one level."""

from __future__ import annotations

import csv
import io
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from boresight.arguments import check_choice, check_machine, check_number
from boresight.disk.output import OutputFile
from boresight.firmware.build import CModel
from boresight.gateware.core import build_core
from boresight.model.estimator import input_words
from boresight.model.estimators import estimator as find_estimator
from boresight.sim.accuracy import attitude_rmse
from boresight.sim.check import with_params
from boresight.sim.cosim import RtlSimulation
from boresight.sim.feed import attitude_of, euler_deg_of, inputs_of, named_outputs, status_of
from boresight.sim.log import read_log
from boresight.sim.segments import interpret
from boresight.verbs.options import Outcome, model_options, params_of

__all__ = ["LEVELS", "add_arguments", "call", "run"]

LEVELS = ("float", "fixed", "c", "rtl")


def run(
    name: str,
    log_path: str | Path,
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
    on : str
        "float", "fixed" (integer interpreter), "c" or "rtl" (Verilator).
    output : path, optional
        CSV with one row per input row: t, qw, qx, qy, qz, heading, pitch and roll in degrees,
        status.

    Returns
    -------
    dict
        ``t`` (n,), ``q`` (n, 4), ``euler_deg`` (n, 3: heading, pitch, roll), ``status`` (n,),
        ``rmse_deg`` against the log's reference, or None.

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
    estimator.param_values(params)
    target = None if output is None else OutputFile(output, "run", of=name, inputs=[log_path])
    log = read_log(log_path)
    real = inputs_of(estimator, log)[:steps]
    if on == "float":
        result = estimator.run_float(real[:, :, None], params=params)
        outputs = {k: v[:, 0] for k, v in result.outputs.items()}
    else:
        program = with_params(estimator.compile(word=word), estimator, params)
        words = input_words(program, real[:, :, None])[:, :, 0]
        if on == "fixed":
            out = interpret(program, words).outputs
        elif on == "c":
            out, _ = CModel(program).update(words)
        else:
            core = build_core(program, config, urgent=estimator.urgent)
            out = (
                RtlSimulation(
                    core.verilog(instances=False),
                    word=word,
                    n_inputs=len(program.inputs),
                    n_outputs=len(program.outputs),
                    lanes=core.machine.lanes,
                )
                .run(words, max_interval=core.schedule.interval)
                .outputs
            )
        outputs = named_outputs(program, out)
    n = len(real)
    q, euler, status = attitude_of(outputs), euler_deg_of(outputs), status_of(outputs)
    rmse = None
    if log.q is not None:
        mov = log.mov[:n] if log.mov is not None else np.ones(n, dtype=bool)
        rmse = attitude_rmse(q, log.q[:n], mov)._asdict()
    if target is not None:
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(
            ["t", "qw", "qx", "qy", "qz", "heading_deg", "pitch_deg", "roll_deg", "status"]
        )
        for k in range(n):
            writer.writerow(
                [
                    repr(float(log.t[k])),
                    *(f"{x:.10f}" for x in q[k]),
                    *(f"{x:.7f}" for x in euler[k]),
                    int(status[k]),
                ]
            )
        target.write(text.getvalue())
    return {
        "estimator": name,
        "on": on,
        "log": log.name,
        "t": log.t[:n],
        "q": q,
        "euler_deg": euler,
        "status": status,
        "rmse_deg": rmse,
    }


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""
    parser.add_argument("estimator")
    parser.add_argument("log")
    parser.add_argument("--on", default="fixed", help="float, fixed, c or rtl")
    model_options(parser)
    parser.add_argument("--steps", type=int)
    parser.add_argument("-o", "--output", metavar="OUT.csv")


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    if args.output is None and not args.json:
        args.output = f"{args.estimator}-{args.on}.csv"
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
    plain = {k: v.tolist() if hasattr(v, "tolist") else v for k, v in data.items()}
    text = f"{len(data['t'])} rows to {args.output}"
    if data["rmse_deg"]:
        text += ", RMSE against the log's reference, deg: " + ", ".join(
            f"{k} {v:.3f}" for k, v in data["rmse_deg"].items()
        )
    return 0, plain, text
