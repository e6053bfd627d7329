"""The command line: from words to a verb's function, and from its result or error to an exit code.

0: good. 1: a check failed, a tool is missing or failed, or memory ran out. 2: bad usage or bad
input. 3: a bug of Boresight. 130: Ctrl-C. 141: standard output is closed. 143: SIGTERM.
"""

from __future__ import annotations

import inspect
import json
import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from difflib import get_close_matches
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, CycloptsError, Parameter
from cyclopts import exceptions as bad

import boresight
from boresight.model.errors import InputError, ToolMissing, shortened
from boresight.model.settings import using
from boresight.model.tools.external import ToolFailed
from boresight.model.tools.files import overwriting
from boresight.options import with_baseline
from boresight.verbs import VERBS

#: Environment variable that makes a bug show its traceback.
DEBUG = "BORESIGHT_DEBUG"
#: Longest text of an unexpected error, characters.
_LONGEST = 160


def _default(value: Any) -> str | None:
    """Text of a default; None of one that says nothing."""
    if value in (None, "", ()) or isinstance(value, bool):
        return None
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


#: No --no-OPTION, and no default that says nothing.
_PLAIN: Any = Parameter(negative=(), show_default=_default)


@Parameter(name="*", negative=())
@dataclass(frozen=True)
class _Shown:
    """How a verb tells its result."""

    json: Annotated[bool, Parameter(help="Print the result as one JSON object.")] = False
    quiet: Annotated[bool, Parameter(alias="-q", help="Print no progress.")] = False
    force: Annotated[bool, Parameter(help="Overwrite files that boresight did not write.")] = False


def app(*verbs: str) -> App:
    """The command line; only the modules of the named verbs are imported."""
    whole = App(
        name="boresight",
        help="Estimators and controllers from equations to an FPGA core and C.",
        version=boresight.__version__,
        version_flags="--version",
        help_format="restructuredtext",
        default_parameter=_PLAIN,
    )
    for place, (name, summary) in enumerate(VERBS.items()):
        function: Callable[..., Any] = _stub
        epilogue = None
        if name in verbs:
            function = _command(name)
            text = import_module(f"boresight.verbs.{name}").__doc__ or ""
            epilogue = "".join(f"| {line}\n" for line in text.splitlines()[2:])
        shown: Any = {"help": summary, "help_epilogue": epilogue, "sort_key": place}
        whole.command(function, name=name, default_parameter=_PLAIN, **shown)
    whole.register_install_completion_command(add_to_startup=True)
    return whole


def _stub() -> None:
    """A verb that is listed, and not called."""


def _command(name: str) -> Callable[..., int]:
    """The function of a verb with the options of its groups; it prints and returns the code."""
    module = import_module(f"boresight.verbs.{name}")
    function: Callable[..., Any] = getattr(module, name)
    groups: dict[Any, Any] = {
        group: inspect.signature(group, eval_str=True).parameters
        for group in getattr(module, "GROUPS", ())
    }
    typed: Callable[..., dict[str, Any]] | None = getattr(module, "typed", None)
    signature = inspect.signature(function, eval_str=True)

    @wraps(function)
    def command(*words: Any, **options: Any) -> int:
        shown, found = options.pop("shown", _Shown()), dict[str, Any]()
        for group, names in groups.items():
            found |= group(**{name: options.pop(name) for name in names if name in options})
        file = found.pop("baseline", None)
        if "progress" in signature.parameters and not shown.quiet:
            options["progress"] = tell
        with ExitStack() as stack:
            stack.enter_context(overwriting(shown.force))
            stack.enter_context(using(**found))
            if typed is not None:
                options |= typed(words, options, shown)
            result = with_baseline(function(*words, **options), file)
        _print(json.dumps(result.to_json()) if shown.json else str(result))
        return int(not getattr(result, "good", True))

    kind: Any = {"kind": inspect.Parameter.KEYWORD_ONLY, "default": None}
    shown = inspect.Parameter("shown", annotation=_Shown, **kind)
    more = [parameter for names in groups.values() for parameter in names.values()]
    parameters = [*signature.parameters.values(), *more, shown]
    vars(command)["__signature__"] = signature.replace(parameters=parameters)
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    return command


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line; returns the exit code."""
    words = [*(sys.argv[1:] if argv is None else argv)]
    try:
        with ExitStack() as stack:
            _terminable(stack)
            function, bound = parse(words)
            return int(function(*bound.args, **bound.kwargs) or 0)
    except (Exception, KeyboardInterrupt) as error:
        code = _code_of(error)
        if code in (1, 2, 3) and "--json" in words:
            parts = error.parts if isinstance(error, InputError) else {}
            _print(json.dumps({"error": {"message": str(error).partition("\n")[0], **parts}}))
        return code


def parse(words: Sequence[str]) -> tuple[Callable[..., Any], inspect.BoundArguments]:
    """The function of a command line and its arguments; errors of usage as `InputError`."""
    words = [*words] or ["--help"]
    verb = words[0] if words[0] in VERBS else ""
    if not verb and words[0] not in ("--help", "-h", "--version", "--install-completion"):
        near = get_close_matches(words[0], VERBS, 1, 0.6)
        fix = f"write {near[0]}" if near else "boresight --help says what each is for"
        raise InputError.at("", wanted=f"a verb: {', '.join(VERBS)}", found=words[0], fix=fix)
    try:
        function, bound, _ = app(verb).parse_args(words, print_error=False, exit_on_error=False)
    except CycloptsError as error:
        raise _usage(error, verb) from None
    return function, bound


def _usage(error: CycloptsError, verb: str) -> InputError:
    fix = f"see boresight {verb} --help"
    argument = error.argument
    where = verb if argument is None or not argument.names else argument.names[0]
    if isinstance(error, bad.UnknownOptionError):
        word = error.token.keyword or error.token.value
        flags = [name[2:] for a in error.argument_collection if a.parse for name in a.names]
        near = get_close_matches(word.partition("=")[0].lstrip("-"), flags, 1, 0.7)
        fix = f"write --{near[0]}; {fix}" if near else f"leave it out; {fix}"
        return InputError.at(verb, wanted="an option of this verb", found=word, fix=fix)
    if isinstance(error, bad.UnusedCliTokensError):
        found = " ".join(error.unused_tokens or ())
        return InputError.at(verb, wanted="no more arguments", found=found, fix=fix)
    if isinstance(error, bad.MissingArgumentError):
        wanted = where if where.isupper() else "a value"
        where = verb if where.isupper() else where
        return InputError.at(where, wanted=wanted, found="none", fix=fix)
    if isinstance(error, bad.CoercionError) and error.token is not None:
        kinds = {"int": "a whole number", "float": "a number"}
        hint = "" if argument is None else str(argument.hint)
        wanted = next((text for kind, text in kinds.items() if kind in hint), "a value")
        return InputError.at(where, wanted=wanted, found=repr(error.token.value), fix=fix)
    return InputError(f"{where}: {str(error).rstrip('.')}; {fix}")


def _terminable(stack: ExitStack) -> None:
    """Let SIGTERM end the work as Ctrl-C does, with clean-up and its own exit code."""

    def stop(number: int, frame: object) -> None:
        raise KeyboardInterrupt("terminated")

    with suppress(ValueError):  # not the main thread
        stack.callback(signal.signal, signal.SIGTERM, signal.signal(signal.SIGTERM, stop))


def _code_of(error: BaseException) -> int:
    """Print an error as one line on standard error; returns the exit code."""
    # Amaranth's warning of gateware that was not elaborated because of the error.
    warnings.filterwarnings("ignore", ".* created but never used")
    if isinstance(error, BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing to flush at exit
        return 141
    if isinstance(error, KeyboardInterrupt):
        tell(str(error) or "interrupted")
        return 143 if str(error) else 130
    if isinstance(error, MemoryError):
        error = ToolFailed("out of memory; use smaller inputs, or a computer with more memory")
    if isinstance(error, OSError) and error.strerror:
        where = "a file" if error.filename is None else os.fsdecode(error.filename) or "''"
        wanted, found = "a path that can be used", error.strerror.lower()
        error = InputError.at(where, wanted=wanted, found=found, fix="check the path")
    if isinstance(error, InputError | ToolMissing | ToolFailed):
        tell(f"error: {str(error).splitlines()[0]}")
        return 2 if isinstance(error, InputError) else 1
    if os.environ.get(DEBUG):
        tell("".join(traceback.format_exception(error)).rstrip())
    last = traceback.extract_tb(error.__traceback__)[-1]
    text = shortened(" ".join(f"{type(error).__name__}: {error}".split()), _LONGEST)
    tell(
        f"error: a bug of Boresight, {text} ({Path(last.filename).name}, line {last.lineno}); "
        f"please report it with the traceback ({DEBUG}=1 shows it)"
    )
    return 3


def tell(text: str) -> None:
    """Print a line on standard error, for progress and errors."""
    print(text, file=sys.stderr, flush=True)


def _print(text: str) -> None:
    if text:
        print(text.encode(sys.stdout.encoding or "utf-8", "backslashreplace").decode(), flush=True)
