"""The command line: choice of the verb, and exit codes.

0 good; 1 a check failed, a tool is missing, a worker was killed, or memory ran out; 2 bad usage or
bad input; 3 a bug of Boresight; 130 ended by Ctrl-C; 141 the reader of standard output has gone.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from itertools import chain, takewhile
from pathlib import Path
from typing import Any, NoReturn

import shtab

import boresight
from boresight.failures import code_of, interruptible
from boresight.model.errors import InputError, closest, shortened
from boresight.model.resolve import profiles
from boresight.model.tolerances import tolerances
from boresight.model.tools.files import overwriting
from boresight.options import (
    JUDGES,
    LOG_ARGUMENTS,
    PROFILE_ARGUMENTS,
    PROFILED,
    READS_LOGS,
    TOLERANCE_ARGUMENTS,
    Argument,
    Verb,
    chosen_profiles,
    chosen_rows,
)
from boresight.terminal import say, tell
from boresight.verbs import VERBS

__all__ = ["arguments_of", "help_of", "main", "parse", "verb_of"]

#: Longest complaint about the command line, in characters.
_LONGEST = 300
#: Options of all verbs, also in front of them, and those without a verb.
_OF_ALL = ("--json", "--quiet", "-q", "--force")
_OF_NONE = ("--help", "-h", "--version", "--print-completion")
#: Messages of argparse, and their replacements.
_WORDS = {
    "^the following arguments are required: (.*)": r"wanted \1, found none",
    "expected one argument$": "wanted a value, found none",
}


class _Parser(argparse.ArgumentParser):
    """argparse with errors of one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line, exit 2."""
        for kind, wanted in (("int", "a whole number"), ("float", "a number")):
            message = message.replace(f"invalid {kind} value:", f"wanted {wanted}, found")
        text = shortened(str(InputError(message.removeprefix("argument "))), _LONGEST)
        if text.startswith("the following arguments are required: VERB"):
            text = f"wanted a verb: {', '.join(VERBS)}, found none"
        elif match := re.match(r"VERB: invalid choice: '(.*?)' \(", text):
            text = (
                f"wanted a verb such as {', '.join(closest(match[1], VERBS))}, found '{match[1]}'"
            )
        for pattern, replacement in _WORDS.items():
            text = re.sub(pattern, replacement, text)
        tell(f"error: {text}; see {self.prog} --help")
        self.exit(2)

    def print_help(self, file: Any = None) -> None:
        """Print the help, unless standard output has gone."""
        say(self.format_help().rstrip("\n"))


class _Print(argparse.Action):
    """Print a text, and end."""

    def __init__(self, *words: Any, text: Callable[[str], str], **settings: Any) -> None:
        super().__init__(*words, **settings)
        self.text = text

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: Any = None) -> None:
        say(self.text(values))
        parser.exit()


def verb_of(name: str) -> Verb:
    """A verb by name; its module is imported."""
    verb: Verb = import_module(f"boresight.{VERBS[name]}").VERB
    return verb


def arguments_of(name: str) -> list[Argument]:
    """All arguments of a verb; its module is imported."""
    shared = (
        (PROFILED, PROFILE_ARGUMENTS),
        (JUDGES, TOLERANCE_ARGUMENTS),
        (READS_LOGS, LOG_ARGUMENTS),
    )
    shared_arguments = (arguments for verbs, arguments in shared if name in verbs)
    return [*verb_of(name).arguments.values(), *chain.from_iterable(shared_arguments)]


@cache
def help_of(name: str) -> tuple[str, list[tuple[str, str]]]:
    """Summary of a verb, and its examples with descriptions; its module is not imported."""
    path = Path(__file__).parent / f"{VERBS[name].replace('.', '/')}.py"
    summary, _, rest = (ast.get_docstring(ast.parse(path.read_bytes())) or "").partition("\n\n")
    examples = [line.strip().partition("  # ") for line in rest.splitlines()]
    return " ".join(summary.split()), [(line, text) for line, _, text in examples]


def _parser(*verbs: str) -> _Parser:
    """The parser of the command line, with the arguments of some verbs."""
    parser = _Parser(
        prog="boresight", description="Estimators from equations to FPGA, proven equal bit by bit."
    )
    parser.add_argument(
        "--version",
        action=_Print,
        nargs=0,
        text=lambda _: boresight.__version__,
        help="show program's version number and exit",
    )
    parser.add_argument(
        "--print-completion",
        action=_Print,
        text=lambda shell: shtab.complete(_parser(*VERBS), shell=shell),
        choices=shtab.SUPPORTED_SHELLS,
        metavar="SHELL",
        help=f"print a script that completes command lines: {', '.join(shtab.SUPPORTED_SHELLS)}",
    )
    subparsers = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name in VERBS:
        # Only the help shows them, of all verbs or of the one that is named.
        summary, examples = help_of(name) if name in verbs or not verbs else ("", [])
        width = max((len(line) for line, _ in examples), default=0)
        lines = ["examples:", *(f"  {line:{width}}  # {text}" for line, text in examples)]
        verb = subparsers.add_parser(
            name,
            help=summary,
            description=summary,
            epilog="\n".join(lines),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        verb.add_argument("--json", action="store_true", help="print one JSON object as the result")
        verb.add_argument("-q", "--quiet", action="store_true", help="no progress")
        verb.add_argument(
            "--force", action="store_true", help="overwrite files that boresight did not write"
        )
        if name in verbs:
            for argument in arguments_of(name):
                argument.add_to(verb)
    return parser


def parse(argv: Sequence[str]) -> dict[str, Any]:
    """Values of a command line by name, and ``verb``; it may end with help or an error."""
    for word in argv:  # argparse would take such a value for the end of all options
        if re.fullmatch(r"(-\w|--[\w-]+=)--", word):
            raise InputError.at(
                word[:-2].rstrip("="), wanted="a value", found="none", fix="write one behind it"
            )
    shared = list(takewhile(_OF_ALL.__contains__, argv))
    argv = [*argv[len(shared) :][:1], *shared, *argv[len(shared) + 1 :]]
    if argv and argv[0].startswith("-") and argv[0].partition("=")[0] not in _OF_NONE:
        raise InputError.at("", wanted="a verb", found=argv[0], fix="its options follow it")
    parsed, unknown = _parser(*VERBS.keys() & {*argv}).parse_known_args(argv)
    if unknown:
        raise _unknown(parsed.verb, unknown)
    return vars(parsed)


def _unknown(verb: str, words: Sequence[str]) -> InputError:
    """The error of words that a verb does not take."""
    hint = f"see boresight {verb} --help"
    if re.fullmatch(r"\w+=\S+", words[0]):
        fix = f"write a parameter as --param {words[0]}"
        if verb == "explore":
            fix += ", an argument of the constructor before the options"
    else:
        flags = [*(flag for argument in arguments_of(verb) for flag in argument.flags), *_OF_ALL]
        names = {flag.lstrip("-"): flag for flag in flags}
        matches = get_close_matches(words[0].partition("=")[0].lstrip("-"), names, 1, 0.7)
        fix = f"write {names[matches[0]]}" if matches else "leave it out"
    return InputError.at(
        verb, wanted="what this verb takes", found=" ".join(words), fix=f"{fix}; {hint}"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    argv = sys.argv[1:] if argv is None else argv
    try:
        with interruptible():
            parsed = parse(argv)
            with (
                overwriting(parsed["force"]),
                profiles(chosen_profiles(parsed)),
                tolerances(parsed.get("tolerance", ())),
                chosen_rows(parsed),
            ):
                code, data, text = verb_of(parsed["verb"]).run(parsed)
            if parsed["json"]:
                say(json.dumps(data))
            elif text:
                say(text)
            return int(code)
    except (Exception, KeyboardInterrupt) as error:
        code = code_of(error)
        if code in (1, 2, 3) and "--json" in argv:
            parts = error.parts if isinstance(error, InputError) else {}
            say(json.dumps({"error": {"message": str(error).partition("\n")[0], **parts}}))
        return code


if __name__ == "__main__":
    sys.exit(main())
