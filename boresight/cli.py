"""The command line: which verb, and what its end means for the exit code.

0 good; 1 a check failed, a tool is missing, a worker was killed, or memory ran out; 2 bad usage or
bad input; 3 a bug of Boresight; 130 ended by Ctrl-C; 141 the reader of standard output has gone.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import shtab

import boresight
from boresight.failures import code_of, interruptible
from boresight.model.errors import InputError, shortened
from boresight.model.resolve import profiles
from boresight.options import PROFILED, chosen_profiles, profile_options
from boresight.terminal import say, tell
from boresight.verbs import place_of
from boresight.verbs.texts import VERBS, Text

__all__ = ["main"]

#: Longest complaint about the command line, in characters.
_LONGEST = 300


class _Parser(argparse.ArgumentParser):
    """argparse with errors of one line."""

    verbs: argparse._SubParsersAction[_VerbParser]

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

    def load(self) -> None:
        """Add the verb's arguments, once."""
        if self.verb:
            module = import_module(f"boresight.{place_of(self.verb)}")
            self.set_defaults(call=module.call)
            module.add_arguments(self)
            if self.verb in PROFILED:
                profile_options(self)
            self.verb = ""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Add the verb's arguments, then parse."""
        self.load()
        return super().parse_known_args(args, namespace)


class _Completion(argparse.Action):
    """Print a script that completes the command line in a shell, and end."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: Any = None) -> None:
        for verb in parser.verbs.choices.values():
            verb.load()
            for action in verb._actions:
                if action.nargs != 0:
                    action.complete = shtab.FILE
        say(shtab.complete(parser, shell=values))
        parser.exit(0)


def _examples(text: Text) -> str:
    """The examples of a verb, below each other."""
    width = max(len(line) for line, _ in text.examples)
    lines = [f"  boresight {line:{width}}  # {what}" for line, what in text.examples]
    return "\n".join(("examples:", *lines))


def _parser() -> _Parser:
    parser = _Parser(
        prog="boresight", description="Estimators from equations to FPGA, proven equal bit by bit."
    )
    parser.add_argument("--version", action="version", version=boresight.__version__)
    parser.add_argument(
        "--print-completion",
        action=_Completion,
        choices=shtab.SUPPORTED_SHELLS,
        metavar="SHELL",
        help=f"print a script that completes command lines: {', '.join(shtab.SUPPORTED_SHELLS)}",
    )
    parser.verbs = verbs = parser.add_subparsers(
        dest="verb", metavar="VERB", required=True, parser_class=_VerbParser
    )
    for name, text in VERBS.items():
        verb = verbs.add_parser(
            name,
            help=text.summary,
            description=text.summary,
            epilog=_examples(text),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        verb.verb = name
        verb.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
        verb.add_argument("-q", "--quiet", action="store_true", help="no progress")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    try:
        with interruptible():
            args = _parser().parse_args(argv)
            with profiles(chosen_profiles(args)):
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
