"""The command line. Exit codes: 0 good, 1 a check failed, 2 bad usage or bad input."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

import boresight
from boresight.demo import summary_table
from gateware.slots import ScheduleError
from gateware.synthesis.yosys import SynthesisError
from model.errors import InputError, ToolMissing
from sim.check import LEVELS, CheckResult
from sim.cosim import SimulationFailed
from sim.divergence import replay_reproducer

__all__ = ["main"]


class _Parser(argparse.ArgumentParser):
    """argparse with one-line errors."""

    def error(self, message: str) -> Any:
        """Print one line, exit 2."""
        self.exit(2, f"error: {message} (see {self.prog} --help)\n")


def _params(items: Sequence[str]) -> dict[str, float]:
    out = {}
    for item in items:
        name, _, text = item.partition("=")
        try:
            out[name] = float(text)
        except ValueError:
            raise InputError.at(f"--param {item}", wanted="NAME=NUMBER", found=repr(text),
                                fix="write for example --param kp_pitch_per_s=0.5") from None
    return out


def _parser() -> _Parser:
    parser = _Parser(prog="boresight", description="Attitude estimators from equations to FPGA, "
                     "proven equal bit by bit.")
    parser.add_argument("--version", action="version", version=boresight.__version__)
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True,
                                  parser_class=_Parser)

    def verb(name: str, text: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=text, description=text)
        sub.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
        sub.add_argument("-q", "--quiet", action="store_true", help="no progress")
        return sub

    def model_options(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--config", default="small", help="small (one lane) or fast (two lanes)")
        sub.add_argument("--word", type=int, default=32, help="word width, 18 to 32 bits")
        sub.add_argument("--param", action="append", default=[], metavar="NAME=NUMBER",
                         help="parameter value, repeatable")

    verb("list", "Estimators, their parameters, configurations.")
    sub = verb("compile", "Write Verilog, ISE project, microcode, register map, C, report.json.")
    sub.add_argument("estimator")
    model_options(sub)
    sub.add_argument("--board", help="also write the ISE project: mimas or sk-xc6slx9")
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
    sub.add_argument("estimator", help="estimator, or the word replay")
    sub.add_argument("logs", nargs="+", metavar="LOG", help="logs, or folders of logs")
    model_options(sub)
    sub.add_argument("--steps", type=int, help="leading samples of each log")
    sub.add_argument("--levels", default="fixed,c,rtl", help=f"some of {','.join(LEVELS)}")
    sub.add_argument("--simulator", help="verilator or icarus; default: what is there")
    sub.add_argument("--reproducer", default="reproducer.json", metavar="FILE",
                     help="written when a level differs; run it with: boresight check replay FILE")

    sub = verb("report", "Check, estimate and write report.html and report.json.")
    sub.add_argument("estimator")
    sub.add_argument("log")
    model_options(sub)
    sub.add_argument("--steps", type=int)
    sub.add_argument("--no-synth", action="store_true", help="leave area and clock out")
    sub.add_argument("--comparison", action="store_true",
                     help="the log's reference is another device's estimate, not truth")
    sub.add_argument("-o", "--output", default="build", metavar="DIR")

    sub = verb("demo", "The main job: both configurations on the bundled recording.")
    sub.add_argument("-o", "--output", default="build", metavar="DIR")
    sub.add_argument("--steps", type=int)
    sub = verb("bench", "Interpreter against C on 10,000,000 updates, and their rates.")
    sub.add_argument("--updates", type=int, default=10_000_000)
    verb("doctor", "Which tools are here, and what is missing.")
    return parser


def _list(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.list_estimators()
    lines = []
    for e in data["estimators"]:
        lines.append(f"{e['name']}: {e['summary']}")
        lines += [f"    {p['name']:20s} {p['default']:<10g} {p['unit']:12s} "
                  f"[{p['low']:g}, {p['high']:g}]" for p in e["parameters"]]
    lines.append("configurations: " + ", ".join(
        f"{c['name']} ({c['lanes']} lane{'s' if c['lanes'] > 1 else ''})"
        for c in data["configs"]))
    return 0, data, "\n".join(lines)


def _compile(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.compile(
        args.estimator, config=args.config, board=args.board, word=args.word, synth=args.synth,
        output=args.output, params=_params(args.param), urgent=args.urgent,
        progress=_progress(args))
    timing = data["timing"]["latency_cycles_by_output"]
    text = f"{args.output}: " + ", ".join(f"{k} {v}" for k, v in timing.items()) + " cycles"
    return 0, data, text


def _run(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.output is None and not args.json:
        args.output = f"{args.estimator}-{args.on}.csv"
    data = boresight.run(args.estimator, args.log, on=args.on, config=args.config, word=args.word,
                         params=_params(args.param), steps=args.steps, output=args.output)
    plain = {k: v.tolist() if hasattr(v, "tolist") else v for k, v in data.items()}
    text = f"{len(data['t'])} rows to {args.output}"
    if data["rmse_deg"]:
        text += ", RMSE against the log's reference, deg: " + ", ".join(
            f"{k} {v:.3f}" for k, v in data["rmse_deg"].items())
    return 0, plain, text


def _check(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.estimator == "replay":
        from pathlib import Path
        lines = [line for f in args.logs for line in replay_reproducer(Path(f))]
        return int(bool(lines)), {"differences": lines}, "\n".join(lines) or "no difference"

    def show(result: CheckResult) -> None:
        if args.json:
            return
        print(f"{result.estimator} on {result.log}, {result.config}, W = {result.word}")
        for level in result.levels:
            print(f"  {level.line()}")
        print(f"  fixed against float64: {result.vs_float_until_80_deg:.6f} deg until |pitch| "
              f"first passes 80 deg, {result.vs_float_max_deg:.6f} deg over all", flush=True)

    results = boresight.check(
        args.estimator, *args.logs, config=args.config, word=args.word, steps=args.steps,
        levels=tuple(args.levels.split(",")), simulator=args.simulator,
        params=_params(args.param), reproducer=args.reproducer, progress=_progress(args),
        each=show)
    good = all(r.good for r in results)
    return (0 if good else 1, {"good": good, "results": [r.to_json() for r in results]},
            "good" if good else "FAILED")


def _report(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.report(
        args.estimator, args.log, config=args.config, word=args.word, steps=args.steps,
        synth=not args.no_synth, output=args.output, comparison=args.comparison,
        params=_params(args.param), progress=_progress(args))
    good = all(v.get("good", True) for v in data["verification"])
    return 0 if good else 1, data, f"{args.output}/report.html"


def _demo(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.demo(output=args.output, steps=args.steps, progress=_progress(args))
    text = summary_table(data) + "\n\n" + "\n".join(
        f"report: {r['report']}" for r in data["configurations"])
    return 0 if data["good"] else 1, data, text


def _bench(args: argparse.Namespace) -> tuple[int, Any, str]:
    if args.updates < 1:
        raise InputError.at("--updates", wanted="1 or more", found=str(args.updates),
                            fix="give more updates")
    data = boresight.bench(updates=args.updates, progress=_progress(args))
    text = "\n".join(f"{k:28s} {v:,}" if isinstance(v, int) else f"{k:28s} {v}"
                     for k, v in data.items())
    return int(data["mismatches"] > 0), data, text


def _doctor(args: argparse.Namespace) -> tuple[int, Any, str]:
    data = boresight.doctor()
    lines = [f"{t['tool']:16s} {t['version']}" if t["version"] else
             f"{t['tool']:16s} {'MISSING' if t['needed'] else 'not here'}: {t['advice']}"
             for t in data["tools"] if not args.quiet or (t["needed"] and not t["version"])]
    return 0 if data["good"] else 1, data, "\n".join(lines)


def _progress(args: argparse.Namespace) -> Any:
    if args.quiet or args.json:
        return None
    return lambda text: print(text, file=sys.stderr, flush=True)


_VERBS = {"list": _list, "compile": _compile, "run": _run, "check": _check, "report": _report,
          "demo": _demo, "bench": _bench, "doctor": _doctor}


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    args = _parser().parse_args(argv)
    try:
        code, data, text = _VERBS[args.verb](args)
    except (InputError, ScheduleError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except (ToolMissing, SimulationFailed, SynthesisError) as error:
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
