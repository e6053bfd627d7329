"""The command line. Exit codes: 0 good, 1 a check failed, 2 bad usage or bad input."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import boresight
from boresight.firmware.soc.image import ImageError
from boresight.gateware.slots import ScheduleError
from boresight.gateware.synthesis.yosys import SynthesisError
from boresight.model.errors import InputError, ToolMissing
from boresight.model.estimators import ESTIMATORS
from boresight.model.tool_failure import ToolFailed
from boresight.parameters import values_for
from boresight.sharing import estimator_names, params_for_each
from boresight.sim.check import LEVELS, CheckResult
from boresight.sim.cosim import SimulationFailed
from boresight.sim.divergence import replay_reproducer
from boresight.verbs.accuracy import accuracy_text, params_by_estimator
from boresight.verbs.demo import FILTERS, STEPS, summary_table
from boresight.verbs.experiment import EXPERIMENTS, target_lines
from boresight.verbs.monitor import attitude_line
from boresight.verbs.simulate import faults_text, simulate_text
from boresight.verbs.tune import tuning_text

__all__ = ["main"]


class _Parser(argparse.ArgumentParser):
    """argparse with one-line errors."""

    def error(self, message: str) -> Any:
        """Print one line, exit 2."""
        self.exit(2, f"error: {message} (see {self.prog} --help)\n")


def _params(args: argparse.Namespace) -> dict[str, float]:
    return values_for(args.estimator, args.params, args.param)


def _params_of(args: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """Values of the only estimator, or by estimator."""
    if len(names) > 1:
        return dict(params_for_each(names, args.params, args.param))
    return dict(values_for(names[0], args.params, args.param))


def _parser() -> _Parser:
    parser = _Parser(
        prog="boresight",
        description="Attitude estimators from equations to FPGA, proven equal bit by bit.",
    )
    parser.add_argument("--version", action="version", version=boresight.__version__)
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True, parser_class=_Parser)

    def verb(name: str, text: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=text)
        sub.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
        sub.add_argument("-q", "--quiet", action="store_true", help="no progress")
        return sub

    def number_options(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--word", type=int, default=32, help="word width, 18 to 32 bits")
        sub.add_argument(
            "--params",
            action="append",
            default=[],
            metavar="FILE.json",
            help="parameter values, as tune writes them, repeatable",
        )
        sub.add_argument(
            "--param",
            action="append",
            default=[],
            metavar="NAME=NUMBER",
            help="parameter value, repeatable, on top of the files",
        )

    def model_options(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--config", default="small", help="small (one lane) or fast (two lanes)")
        number_options(sub)

    verb("list", "Estimators, their parameters, configurations.")
    sub = verb("compile", "Write Verilog, ISE project, microcode, register map, C, report.json.")
    sub.add_argument(
        "estimators",
        nargs="+",
        metavar="ESTIMATOR",
        help="several: one core that holds them all, a register says which runs",
    )
    model_options(sub)
    sub.add_argument("--board", help="also write an ISE project: mimas or sk-xc6slx9")
    sub.add_argument(
        "--top",
        default="sensors",
        help="what that is: sensors, the complete system, "
        "or records, the core alone, fed by the host",
    )
    sub.add_argument(
        "--with-cpu",
        action="store_true",
        help="and a soft core with its firmware (needs the RISC-V compiler)",
    )
    sub.add_argument("--synth", action="store_true", help="also estimate area and clock (yosys)")
    sub.add_argument("--urgent", type=int, help="leading outputs whose latency counts first")
    sub.add_argument("-o", "--output", default="build", metavar="DIR")

    sub = verb("run", "Run an estimator on a log; one row out per row in.")
    sub.add_argument("estimator")
    sub.add_argument("log")
    sub.add_argument("--on", default="fixed", help="float, fixed, c or rtl")
    model_options(sub)
    sub.add_argument("--steps", type=int)
    sub.add_argument("-o", "--output", metavar="OUT.csv")

    sub = verb("check", "Prove integer model, C and RTL equal on logs, bit by bit.")
    sub.add_argument(
        "estimator",
        metavar="ESTIMATOR[,ESTIMATOR...]",
        help="estimator; several: all in one core, in turns; or the word replay",
    )
    sub.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    model_options(sub)
    sub.add_argument("--steps", type=int, help="leading samples of each log")
    sub.add_argument("--levels", default="fixed,c,rtl", help=f"some of {','.join(LEVELS)}")
    sub.add_argument("--simulator", help="verilator or icarus; default: what is there")
    sub.add_argument(
        "--reproducer",
        default="reproducer.json",
        metavar="FILE",
        help="written when a level differs; run it with: boresight check replay FILE",
    )

    sub = verb("report", "Check, estimate and write report.html and report.json.")
    sub.add_argument("estimator")
    sub.add_argument("log")
    model_options(sub)
    sub.add_argument("--steps", type=int)
    sub.add_argument("--no-synth", action="store_true", help="leave area and clock out")
    sub.add_argument(
        "--comparison",
        action="store_true",
        help="the log's reference is another device's estimate, not truth",
    )
    sub.add_argument("-o", "--output", default="build", metavar="DIR")

    sub = verb("tune", "Fit parameters to logs with truth, in the open, with cross-validation.")
    sub.add_argument("estimator")
    sub.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    sub.add_argument("--folds", type=int, default=3, help="of the cross-validation; 1: none")
    sub.add_argument("--seed", type=int, help="shuffle the trials before they are dealt to folds")
    sub.add_argument("--only", metavar="A,B,...", help="parameters to tune; default: all")
    sub.add_argument("--rounds", type=int, default=12, help="most rounds of a search")
    sub.add_argument(
        "--detune",
        type=float,
        default=1.0,
        metavar="FACTOR",
        help="start off by this factor, so that folds do not inherit the start",
    )
    sub.add_argument("--jobs", type=int, help="threads; default: one for each processor")
    number_options(sub)
    sub.add_argument("-o", "--output", metavar="PARAMS.json", help="result, for --params")

    sub = verb("accuracy", "Error of our estimators and of published ones on logs with truth.")
    sub.add_argument(
        "logs", nargs="*", metavar="LOG", help="logs, or folders of logs; default: the bundled logs"
    )
    sub.add_argument("--estimators", metavar="A,B,...", help="ours and published; default: all")
    sub.add_argument("--no-peers", action="store_true", help="without the published ones")
    sub.add_argument("--no-float", action="store_true", help="fixed point only")
    sub.add_argument(
        "--comparison",
        metavar="LOG,...",
        default="",
        help="logs whose reference is another device's estimate, not truth",
    )
    sub.add_argument("--jobs", type=int, help="processes; default: one for each processor")
    number_options(sub)
    sub.add_argument("-o", "--output", metavar="DIR", help="also write accuracy.html and .json")

    sub = verb("experiment", "A published experiment in simulation: page and JSON.")
    sub.add_argument("name", help=f"one of: {', '.join(EXPERIMENTS)}")
    sub.add_argument("--seed", type=int, default=1, help="of the first run")
    sub.add_argument("-o", "--output", default="build", metavar="DIR")

    sub = verb(
        "demo",
        "The main job: one core with all filters, both configurations, proven "
        "on the bundled recording.",
    )
    sub.add_argument("-o", "--output", default="build", metavar="DIR")
    sub.add_argument("--steps", type=int, default=STEPS, help="leading samples of the recording")
    sub = verb("bench", "Interpreter against C on 10,000,000 updates, and their rates.")
    sub.add_argument(
        "estimators",
        nargs="*",
        metavar="ESTIMATOR",
        help="which; by default those of the main job, one after the other",
    )
    sub.add_argument("--updates", type=int, default=10_000_000)
    sub = verb(
        "covariance",
        "Millions of hostile updates: does a filter's covariance stay positive, and with float64?",
    )
    sub.add_argument(
        "estimators",
        nargs="*",
        metavar="ESTIMATOR",
        help="which; by default every Kalman filter of the main job",
    )
    sub.add_argument("--updates", type=int, default=10_000_000, help="of each filter")
    sub = verb("monitor", "Attitudes and registers of a board, from its serial port or a capture.")
    sub.add_argument("source", metavar="PORT|CAPTURE")
    sub.add_argument("--baud", type=int, default=921_600, help="bits per second")
    sub.add_argument("--count", type=int, help="attitudes to take; default: all, or for ever")
    sub.add_argument("--csv", metavar="OUT.csv", help="write a table")
    sub.add_argument("--plot", metavar="OUT.png", help="write a picture: .png, .svg or .pdf")
    sub.add_argument(
        "--read",
        action="append",
        default=[],
        metavar="NAME",
        help="read a register, by name or address, repeatable",
    )
    sub.add_argument(
        "--write",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="write a register, before any is read, repeatable",
    )
    sub.add_argument("--map", metavar="REGISTERS.json", help="register map of the bitstream")
    sub = verb("simulate", "The complete board: both sensors at its pins, attitude on its line.")
    sub.add_argument("filter", nargs="?", help="of the long run; default: mekf")
    sub.add_argument("log", nargs="?", help="log with attitude; default: a synthetic motion")
    sub.add_argument("--config", default="small", help="small (one lane) or fast (two lanes)")
    sub.add_argument("--seconds", type=float, default=1.0, help="of the long run")
    sub.add_argument("--source", default="heading", help="the compass sends heading or counts")
    sub.add_argument(
        "--faults",
        action="store_true",
        help="every fault of both sensors instead: when seen, what it does",
    )
    sub.add_argument("-o", "--output", default="build", metavar="DIR")
    verb("doctor", "Which tools are here, and what is missing.")
    return parser


def _list(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.list_estimators()
    lines = []
    for e in data["estimators"]:
        lines.append(f"{e['name']}: {e['summary']}")
        lines += [
            f"    {p['name']:20s} {p['default']:<10g} {p['unit']:12s} [{p['low']:g}, {p['high']:g}]"
            for p in e["parameters"]
        ]
    lines.append(
        "configurations: "
        + ", ".join(
            f"{c['name']} ({c['lanes']} lane{'s' if c['lanes'] > 1 else ''})"
            for c in data["configs"]
        )
    )
    return 0, data, "\n".join(lines)


def _compile(args: argparse.Namespace) -> tuple[int, Any, str]:
    names = estimator_names(*args.estimators)
    data = boresight.compile(
        *names,
        config=args.config,
        board=args.board,
        word=args.word,
        synth=args.synth,
        output=args.output,
        params=_params_of(args, names),
        urgent=args.urgent,
        top=args.top,
        with_cpu=args.with_cpu,
        progress=_progress(args),
    )
    lines = []
    for name, report in data.get("programs", {"": data}).items():
        timing = report["timing"]["latency_cycles_by_output"]
        lines.append(
            f"{args.output}: {name and name + ': '}"
            + ", ".join(f"{k} {v}" for k, v in timing.items())
            + " cycles"
        )
    if "system" in data:
        whole = data["system"]
        clock = whole["clock_mhz_estimate"]
        lines.append(
            f"complete system: {whole['lut']} LUT, {whole['ff']} FF, {whole['dsp']} "
            f"DSP48A1, {whole['ramb16']:g} RAMB16; clock {clock['median']} MHz (estimate, "
            f"-2, median nets; {clock['p75']} with 75th percentile nets)"
        )
    return 0, data, "\n".join(lines)


def _run(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.output is None and not args.json:
        args.output = f"{args.estimator}-{args.on}.csv"
    data = boresight.run(
        args.estimator,
        args.log,
        on=args.on,
        config=args.config,
        word=args.word,
        params=_params(args),
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


def _check(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.estimator == "replay":
        lines = [line for f in args.logs for line in replay_reproducer(Path(f))]
        return int(bool(lines)), {"differences": lines}, "\n".join(lines) or "no difference"

    def show(result: CheckResult) -> None:
        if args.json:
            return
        print(f"{result.estimator} on {result.log}, {result.config}, W = {result.word}")
        for level in result.levels:
            print(f"  {level.line()}")
        print(
            f"  fixed against float64: {result.vs_float_until_80_deg:.6f} deg until |pitch| "
            f"first passes 80 deg, {result.vs_float_max_deg:.6f} deg over all (Euler angles)"
        )
        turn = (
            ""
            if result.vs_float_attitude_deg is None
            else f"{result.vs_float_attitude_deg:.6f} deg between the attitudes, "
        )
        print(
            f"  {turn}{result.status_changed} status words differ, "
            f"{result.saturated_updates} updates saturated",
            flush=True,
        )

    names = estimator_names(args.estimator)
    results = boresight.check(
        args.estimator,
        *args.logs,
        config=args.config,
        word=args.word,
        steps=args.steps,
        levels=tuple(args.levels.split(",")),
        simulator=args.simulator,
        params=_params_of(args, names),
        reproducer=args.reproducer,
        progress=_progress(args),
        each=show,
    )
    good = all(r.good for r in results)
    return (
        0 if good else 1,
        {"good": good, "results": [r.to_json() for r in results]},
        "good" if good else "FAILED",
    )


def _report(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.report(
        args.estimator,
        args.log,
        config=args.config,
        word=args.word,
        steps=args.steps,
        synth=not args.no_synth,
        output=args.output,
        comparison=args.comparison,
        params=_params(args),
        progress=_progress(args),
    )
    good = all(v.get("good", True) for v in data["verification"])
    return 0 if good else 1, data, f"{args.output}/report.html"


def _accuracy(args: argparse.Namespace) -> tuple[int, Any, str]:
    names = None if args.estimators is None else args.estimators.split(",")
    ours = [n for n in ESTIMATORS if names is None or n in names]
    data = boresight.accuracy(
        *args.logs,
        estimators=names,
        peers=not args.no_peers,
        floating=not args.no_float,
        comparisons=[name for name in args.comparison.split(",") if name],
        params=params_by_estimator(ours, args.params, args.param),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=_progress(args),
    )
    text = accuracy_text(data)
    return 0, data, text if args.output is None else f"{text}\n\n{args.output}/accuracy.html"


def _tune(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.tune(
        args.estimator,
        *args.logs,
        folds=args.folds,
        seed=args.seed,
        names=None if args.only is None else args.only.split(","),
        rounds=args.rounds,
        detune=args.detune,
        params=_params(args),
        word=args.word,
        jobs=args.jobs,
        output=args.output,
        progress=_progress(args),
    )
    text = tuning_text(data)
    return 0, data, text if args.output is None else f"{text}\n  written: {args.output}"


def _experiment(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.experiment(
        args.name, output=args.output, seed=args.seed, progress=_progress(args)
    )
    met = sum(t["good"] for t in data["targets"])
    lines = [
        *target_lines(data),
        f"targets met: {met} of {len(data['targets'])}",
        f"{args.output}/{args.name}.html",
    ]
    lines += [f"FAILED: {c['claim']}" for c in data["claims"] if not c["good"]]
    return 0 if data["good"] else 1, data, "\n".join(lines)


def _demo(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.steps < 1:
        raise InputError.at(
            "--steps", wanted="1 or more", found=str(args.steps), fix="give more steps"
        )
    data = boresight.demo(output=args.output, steps=args.steps, progress=_progress(args))
    text = (
        summary_table(data) + "\n\n" + "\n".join(f"report: {r['report']}" for r in data["filters"])
    )
    return 0 if data["good"] else 1, data, text


def _bench(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.updates < 1:
        raise InputError.at(
            "--updates", wanted="1 or more", found=str(args.updates), fix="give more updates"
        )
    results = [
        boresight.bench(name, updates=args.updates, progress=_progress(args))
        for name in estimator_names(*(args.estimators or FILTERS))
    ]
    text = "\n\n".join(
        "\n".join(
            f"{k:28s} {v:,}" if isinstance(v, int) else f"{k:28s} {v}" for k, v in data.items()
        )
        for data in results
    )
    return int(any(data["mismatches"] for data in results)), {"results": results}, text


def _covariance(args: argparse.Namespace) -> tuple[int, Any, str]:
    found = [
        boresight.covariance(name, updates=args.updates, progress=_progress(args))
        for name in estimator_names(*(args.estimators or FILTERS[1:]))
    ]
    good = all(trial.good for trial in found)
    data = {"good": good, "results": [{**asdict(t), "good": t.good} for t in found]}
    return 0 if good else 1, data, "\n".join(t.line() for t in found)


def _monitor(args: argparse.Namespace) -> tuple[int, Any, str]:
    each = None if args.json or args.quiet else lambda a: print(attitude_line(a), flush=True)
    data = boresight.monitor(
        args.source,
        baud=args.baud,
        count=args.count,
        csv=args.csv,
        plot=args.plot,
        reads=args.read,
        writes=args.write,
        register_map=args.map,
        each=each,
    )
    lines = [f"{name} = 0x{word:08x} written" for name, word in data["written"].items()]
    for name, register in data["registers"].items():
        value = register["value"]
        shown = (
            ", ".join(f"{k} {v}" for k, v in value.items())
            if isinstance(value, dict)
            else f"{value:.9g}"
            if isinstance(value, float)
            else str(value)
        )
        lines.append(
            f"{name} = {shown} {register['unit']}".rstrip() + f"  (0x{register['word']:08x})"
        )
    if data["attitudes"] or not lines:
        lines.append(
            f"{len(data['attitudes'])} attitudes, {data['missing']} missing, "
            f"{data['bad']} frames or lines damaged"
        )
    return 0, data, "\n".join(lines)


def _simulate(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.faults:
        if args.log is not None:
            raise InputError.at(
                "--faults",
                wanted="no log: the trials have a motion of their own",
                found=args.log,
                fix="leave it out",
            )
        data = boresight.simulate_faults(args.filter, progress=_progress(args))
        return 0 if data["good"] else 1, data, faults_text(data)
    data = boresight.simulate(
        args.filter,
        args.log,
        config=args.config,
        seconds=args.seconds,
        source=args.source,
        output=args.output,
        progress=_progress(args),
    )
    return 0 if data["good"] else 1, data, f"{simulate_text(data)}\n{args.output}/board.html"


def _doctor(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.doctor()
    lines = [
        f"{t['tool']:16s} {t['version']}"
        if t["version"]
        else f"{t['tool']:16s} {'MISSING' if t['needed'] else 'not here'}: {t['advice']}"
        for t in data["tools"]
        if not args.quiet or (t["needed"] and not t["version"])
    ]
    return 0 if data["good"] else 1, data, "\n".join(lines)


def _progress(args: argparse.Namespace) -> Any:
    if args.quiet or args.json:
        return None
    return lambda text: print(text, file=sys.stderr, flush=True)


_VERBS = {
    "list": _list,
    "compile": _compile,
    "run": _run,
    "check": _check,
    "report": _report,
    "accuracy": _accuracy,
    "tune": _tune,
    "demo": _demo,
    "experiment": _experiment,
    "bench": _bench,
    "covariance": _covariance,
    "simulate": _simulate,
    "doctor": _doctor,
    "monitor": _monitor,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    args = _parser().parse_args(argv)
    try:
        code, data, text = _VERBS[args.verb](args)
    except (InputError, ScheduleError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (ToolMissing, ToolFailed, ImageError, SimulationFailed, SynthesisError) as error:
        print(f"error: {str(error).splitlines()[0]}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    if args.json:
        print(json.dumps(data))
    elif text:
        print(text)
    return code


if __name__ == "__main__":
    sys.exit(main())
