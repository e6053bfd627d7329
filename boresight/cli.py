"""The command line: which verb, and what its end means for the exit code.

0 good; 1 a check failed, or a tool is missing; 2 bad usage or bad input; 3 a bug of Boresight;
130 ended by Ctrl-C; 141 the reader of standard output has gone.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import boresight
from boresight.failures import code_of, interruptible
from boresight.model.errors import InputError, shortened
from boresight.terminal import say, tell
from boresight.verbs import place_of

__all__ = ["main"]

#: What each verb is for; its module (`boresight.verbs.place_of`) holds its arguments and what it
#: does.
VERBS = {
    "list": "Estimators, their parameters, configurations.",
    "compile": "Write Verilog, ISE project, microcode, register map, C, report.json.",
    "run": "Run an estimator on a log; one row out per row in.",
    "check": "Prove integer model, C and RTL equal on logs, bit by bit.",
    "report": "Check, estimate and write report.html and report.json.",
    "tune": "Fit parameters to logs with truth, in the open, with cross-validation.",
    "accuracy": "Error of our estimators and of published ones on logs with truth.",
    "convert": "A published data set's files (BROAD) to logs.",
    "experiment": "A published experiment in simulation: page and JSON.",
    "demo": "The main job: one core with all filters, both configurations, proven on the "
    "bundled recording.",
    "bench": "Interpreter against C on 10,000,000 updates, and their rates.",
    "covariance": "Millions of hostile updates: does a filter's covariance stay positive, and "
    "with float64?",
    "montecarlo": "Many draws of a world: errors, NEES, NIS and spread against the bound.",
    "monitor": "Attitudes and registers of a board, from its serial port or a capture.",
    "simulate": "The complete board: both sensors at its pins, attitude on its line.",
    "doctor": "Which tools are here, and what is missing.",
}
#: Longest complaint about the command line, in characters.
_LONGEST = 300


class _Parser(argparse.ArgumentParser):
    """argparse with errors of one line."""

    def error(self, message: str) -> Any:
        """Print one line, exit 2."""
        for kind, wanted in (("int", "a whole number"), ("float", "a number")):
            message = message.replace(f"invalid {kind} value:", f"wanted {wanted}, found")
        text = shortened(str(InputError(message.removeprefix("argument "))), _LONGEST)
        self.exit(2, f"error: {text} (see {self.prog} --help)\n")

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        if action.option_strings and arg_strings == ["--"]:  # argparse would make it an empty list
            raise argparse.ArgumentError(action, "expected one argument")
        return super()._get_values(action, arg_strings)

    def _print_message(self, message: str, file: Any = None) -> None:
        (tell if file is sys.stderr else say)(message.rstrip("\n"))


class _VerbParser(_Parser):
    """Parser of one verb: its module is imported when the verb is asked for."""

    verb = ""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Add the verb's arguments, then parse."""
        if self.verb:
            module = import_module(f"boresight.{place_of(self.verb)}")
            self.set_defaults(call=module.call)
            module.add_arguments(self)
            self.verb = ""
        return super().parse_known_args(args, namespace)


def _parser() -> _Parser:
    parser = _Parser(
        prog="boresight", description="Estimators from equations to FPGA, proven equal bit by bit."
    )
    parser.add_argument("--version", action="version", version=boresight.__version__)
    verbs = parser.add_subparsers(
        dest="verb", metavar="VERB", required=True, parser_class=_VerbParser
    )
    for name, text in VERBS.items():
        verb = verbs.add_parser(name, help=text, description=text)
        verb.verb = name
        verb.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
        verb.add_argument("-q", "--quiet", action="store_true", help="no progress")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    try:
        with interruptible():
            args = _parser().parse_args(argv)
            code, data, text = args.call(args)
            if args.json:
                say(json.dumps(data))
            elif text:
                say(text)
            return int(code)
    except (Exception, KeyboardInterrupt) as error:
        return code_of(error)


if __name__ == "__main__":
    sys.exit(main())
