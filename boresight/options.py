"""Verbs of the command line from functions: a parameter is an option, its help the docstring.

A positional parameter is an argument; one after the ``*`` is an option of its name, ``--with-cpu``
of ``with_cpu``. A number or a text takes a value; a bool is a flag, ``--no-synth`` where it is True
by default; a sequence of texts is one value with commas; a mapping of numbers takes ``NAME=NUMBER``
as often as wanted. `Option` in its annotation overrides this. A callable is no option. Options that
are not typed are not passed, so that defaults stand in the signature alone.
"""

from __future__ import annotations

import inspect
import re
from argparse import SUPPRESS, ArgumentParser
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeAlias, Union, get_args, get_origin

import shtab

from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.model.tools.files import refuse_inputs
from boresight.parameters import parse_settings, values_for
from boresight.sharing import estimator_names, params_for_each
from boresight.terminal import tell

__all__ = [
    "Argument",
    "Arguments",
    "Config",
    "EstimatorName",
    "EstimatorNames",
    "JUDGES",
    "Jobs",
    "Logs",
    "Option",
    "Outcome",
    "OutputFolder",
    "LOG_ARGUMENTS",
    "PROFILE_ARGUMENTS",
    "PROFILED",
    "Params",
    "PythonOnly",
    "READS_LOGS",
    "TOLERANCE_ARGUMENTS",
    "Urgent",
    "Verb",
    "Word",
    "chosen_profiles",
    "chosen_rows",
    "outcome",
]

#: Exit code, data for ``--json``, text for people.
Outcome: TypeAlias = tuple[int, Any, str]


@dataclass(frozen=True)
class Option:
    """Properties of an option that name, type and docstring of its parameter do not give.

    Attributes
    ----------
    flags : tuple of str
        The long one last.
    metavar : str
        Placeholder of a value.
    help : str
        If the docstring of the function has none.
    required : bool
        At least one value of ``*parameter``.
    repeated : bool
        Each text of a sequence has the flag before it.
    hidden : bool
        For Python alone.
    """

    flags: tuple[str, ...] = ()
    metavar: str | None = None
    help: str = ""
    required: bool = False
    repeated: bool = False
    hidden: bool = False


PythonOnly = Option(hidden=True)
_ESTIMATOR = Option(metavar="ESTIMATOR", help="Name, or FILE.py:CLASS.")
_SEVERAL = replace(_ESTIMATOR, metavar="ESTIMATOR[,ESTIMATOR...]")

# Parameters of several verbs.
EstimatorName: TypeAlias = Annotated[Named, _ESTIMATOR]
EstimatorNames: TypeAlias = Annotated[Named, _SEVERAL]
Logs: TypeAlias = Annotated[
    Any, Option(metavar="LOG", help="Logs, or folders of logs.", required=True)
]
Config: TypeAlias = Annotated[
    str,
    Option(
        help="small (one lane), fast (two lanes); behind it -1024 or -2048 for two or four times "
        "the registers, then -d9, -d10 or -d12 for a deeper pipeline."
    ),
]
Word: TypeAlias = Annotated[int, Option(help="Word width, 18 to 32 bits.")]
Urgent: TypeAlias = Annotated[
    int | None, Option(help="Leading outputs whose latency counts first; default: as declared.")
]
Jobs: TypeAlias = Annotated[int | None, Option(help="At once; default: one for each processor.")]
OutputFolder: TypeAlias = Annotated[
    str | Path, Option(("-o", "--output"), "DIR", "Folder for the files.")
]
# Of a function's ``params``: `Arguments.call` makes one mapping of both.
_PARAMS = Option(metavar="FILE.json", help="Parameter values, as tune writes them, repeatable.")
_PARAM = Option(metavar="NAME=NUMBER", help="Parameter value, repeatable, on top of the files.")
Params: TypeAlias = Annotated[Mapping[str, Any] | None, _PARAMS]
#: Kinds of values that can be typed.
_KINDS = {bool, int, float, str, Any, Path, Mapping, Sequence, Collection}


@dataclass(frozen=True)
class Argument:
    """A parameter as an argument of the command line.

    Attributes
    ----------
    name : str
        Name in the result of argparse.
    flags : tuple of str
        Empty for a positional one.
    settings : dict
        For `ArgumentParser.add_argument`.
    text : str
        Its help.
    convert : callable
        From the value of argparse to that of the function.
    option : Option
    """

    name: str
    flags: tuple[str, ...]
    settings: dict[str, Any]
    text: str
    convert: Callable[[Any], Any]
    option: Option

    @property
    def shown(self) -> str:
        """Its flags, and the placeholder of its value."""
        value = "" if "const" in self.settings else self.settings["metavar"] or self.name.upper()
        return " ".join(filter(None, (", ".join(self.flags), value)))

    def add_to(self, parser: ArgumentParser) -> None:
        """Add it, with completion by files."""
        names = self.flags or (self.name,)
        dest: dict[str, Any] = {"dest": self.name} if self.flags else {}
        action: Any = parser.add_argument(
            *names, **dest, **self.settings, default=SUPPRESS, help=self.text.replace("%", "%%")
        )
        if action.nargs != 0:
            action.complete = shtab.FILE


#: Verbs that compile estimators, and so take profiles.
PROFILED = (
    *("compile", "run", "check", "report", "explore", "simulate", "demo"),
    *("accuracy", "bench", "covariance", "montecarlo", "tune"),
)


def parameter_texts(function: Callable[..., Any]) -> dict[str, str]:
    """Texts of the section Parameters of a docstring, by name, without backquotes."""
    section = re.search(
        r"^Parameters\n-+\n(.*?)(?=\n[^\n]+\n---|\Z)", inspect.getdoc(function) or "", re.M | re.S
    )
    texts: dict[str, list[str]] = {}
    names: list[str] = []
    for line in section[1].splitlines() if section else ():
        if line[:1].strip():
            names = line.partition(" : ")[0].split(", ")
            texts |= {name: [] for name in names}
        for name in names if line[:1].isspace() else ():
            texts[name].append(line.strip().replace("`", ""))
    return {name: " ".join(lines) for name, lines in texts.items()}


def arguments_of(function: Callable[..., Any]) -> dict[str, Argument]:
    """Arguments of the command line for a function's parameters, by name."""
    texts = parameter_texts(function)
    arguments: list[Argument] = []
    for p in inspect.signature(function, eval_str=True).parameters.values():
        annotated = get_origin(p.annotation) is Annotated
        kind, *metadata = get_args(p.annotation) if annotated else [p.annotation]
        option = next((x for x in metadata if isinstance(x, Option)), Option())
        union = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
        kinds = {get_origin(k) or k for k in union}
        if option.hidden or kinds.isdisjoint(_KINDS):
            continue
        text = option.help if option is _PARAMS else texts.get(p.name) or option.help
        arguments.append(_argument(p, kinds, option, text))
        if option is _PARAMS:
            arguments.append(_argument(p.replace(name="param"), kinds, _PARAM, _PARAM.help))
    return {argument.name: argument for argument in arguments}


def _argument(p: inspect.Parameter, kinds: set[Any], option: Option, text: str) -> Argument:
    """A parameter of some kinds."""
    positional = p.kind is not p.KEYWORD_ONLY
    flags = option.flags or (f"--{'no-' * (p.default is True)}{p.name.replace('_', '-')}",)
    settings: dict[str, Any] = {"metavar": option.metavar}
    convert: Callable[[Any], Any] = _same
    if positional:
        is_variadic = p.kind is p.VAR_POSITIONAL
        settings["metavar"] = option.metavar or p.name.upper()
        if is_variadic or p.default is not p.empty:
            settings["nargs"] = ("+" if option.required else "*") if is_variadic else "?"
    elif bool in kinds:
        settings = {"action": "store_const", "const": not p.default}
    elif Mapping in kinds or option.repeated:
        settings["action"] = "append"
        convert = _same if option.repeated else partial(parse_settings, option=flags[-1])
    elif Sequence in kinds or Collection in kinds:
        convert = _split
    elif numbers := kinds & {int, float}:
        (settings["type"],) = numbers
    default = ",".join(map(str, p.default)) if isinstance(p.default, tuple) else p.default
    has_no_default = isinstance(default, bool) or default in (p.empty, None, "")
    if not has_no_default and "default" not in text:
        text = f"{text.removesuffix('.')}; default {default}."
    return Argument(p.name, () if positional else flags, settings, text, convert, option)


def _same(value: Any) -> Any:
    return value


def _split(text: str) -> list[str]:
    return text.split(",")


#: Further arguments of each of `PROFILED`.
PROFILE_ARGUMENTS = (
    Argument(
        "profile",
        ("--profile",),
        {"action": "append", "metavar": "FILE"},
        "Ranges for formats, as fit writes them, repeatable; default: beside the estimator.",
        _same,
        Option(),
    ),
    Argument(
        "no_profile",
        ("--no-profile",),
        {"action": "store_const", "const": True},
        "Formats by intervals alone.",
        _same,
        Option(),
    ),
)


#: Verbs that judge, or refuse, by the tolerances of outputs.
JUDGES = ("check", "compile", "report", "fit", "explore")

#: Further arguments of each of `JUDGES`.
TOLERANCE_ARGUMENTS = (
    Argument(
        "tolerance",
        ("--tolerance",),
        {"action": "append", "metavar": "OUTPUT=NUMBER"},
        "Accepted error of an output instead of the declared one, 0.05deg for example; repeatable.",
        _same,
        Option(),
    ),
)

#: Verbs that read logs.
READS_LOGS = ("run", "check", "report", "tune", "accuracy", "fit", "convert", "explore")


def _log_argument(flag: str, metavar: str, text: str, kind: type = str) -> Argument:
    settings = {"metavar": metavar, "type": kind}
    return Argument(f"log_{flag}", (f"--{flag}",), settings, text, _same, Option())


#: Further arguments of each of `READS_LOGS`.
LOG_ARGUMENTS = (
    _log_argument("from", "TIME", "Begin of the slice of each log, 10s, from its first row on."),
    _log_argument("to", "TIME", "End of the slice."),
    _log_argument("every", "N", "Every n-th row; its time step is that of n.", int),
    _log_argument(
        "gaps", "RULE", "Steps of over three medians, counted: refuse, bridge or restart."
    ),
    _log_argument("map", "FILE.toml", "Topics, fields, units, frames of a flight log or bag."),
)


def chosen_rows(parsed: Mapping[str, Any]) -> AbstractContextManager[None]:
    """Context in which only the selected rows of logs are read; raises InputError."""
    names = ("from", "to", "every", "gaps", "map")
    values = [parsed.get(f"log_{name}") for name in names]
    if all(value is None for value in values):
        return nullcontext()
    from boresight.sim.records.selection import Selection, selected  # most command lines need none

    return selected(Selection.of(*values))


def chosen_profiles(parsed: Mapping[str, Any]) -> list[str] | None:
    """Files of profiles; None: those beside the estimators' files.

    Raises
    ------
    InputError
        Files together with ``--no-profile``.
    """
    files: list[str] | None = parsed.get("profile")
    if files and "no_profile" in parsed:
        raise InputError.at(
            "--profile",
            wanted="a profile, or --no-profile",
            found="both",
            fix="leave one of them out",
        )
    return [] if "no_profile" in parsed else files


@dataclass
class Arguments:
    """Arguments as typed.

    Attributes
    ----------
    arguments : mapping of str to Argument
        Arguments of the verb.
    typed : dict
        Values by name, as argparse gives them.
    json, quiet : bool
    """

    arguments: Mapping[str, Argument]
    typed: dict[str, Any]
    json: bool
    quiet: bool

    @property
    def progress(self) -> Callable[[str], None] | None:
        """Where progress goes: stderr, also with ``--json``, unless ``--quiet``."""
        return None if self.quiet else tell

    @property
    def params(self) -> tuple[list[str], list[str]]:
        """Parameter files, and texts ``NAME=NUMBER``.

        Raises
        ------
        InputError
            A file that is also the output.
        """
        files = self.typed.get("params", [])
        for name in ("output", "reproducer"):
            if self.typed.get(name):
                refuse_inputs(self.typed[name], files, self.arguments[name].flags[0])
        return files, self.typed.get("param", [])

    def only(
        self,
        function: Callable[..., Any],
        *,
        wanted: str = "another use of this verb",
        uses: Mapping[Callable[..., Any], str] | None = None,
        found: str = "one without it",
        instead: str = "",
    ) -> None:
        """Refuse options that a function does not take.

        Parameters
        ----------
        wanted, found : str
            Use that these options belong to, and the use that is run.
        uses : mapping, optional
            Functions whose use is named instead of ``wanted`` for the options that they take.
        instead : str
            Another remedy, before "leave it out".

        Raises
        ------
        InputError
            One of them was typed.
        """
        valid = arguments_of(function)
        for name in self.typed:
            if name not in valid:
                flag = self.arguments[name].flags[-1]
                for other, use in (uses or {}).items():
                    wanted = use if name in arguments_of(other) else wanted
                fix = f"{instead}leave {flag} out"
                raise InputError.at(flag, wanted=wanted, found=found, fix=fix)

    def call(self, function: Callable[..., Any], *positional: Any, **more: Any) -> Any:
        """Call a function with the typed arguments.

        Parameters
        ----------
        positional
            By default as typed.
        more
            Keywords on top of those that were typed.

        Raises
        ------
        InputError
            An option that the function does not take; a wrong value.
        """
        self.only(function)
        valid = arguments_of(function)
        options = {
            name: argument.convert(self.typed[name])
            for name, argument in valid.items()
            if argument.flags and name in self.typed and name not in ("params", "param")
        }
        signature = inspect.signature(function)
        if not positional:
            for name, argument in valid.items():
                if not argument.flags and name in self.typed:
                    value = self.typed[name]
                    positional += tuple(value) if isinstance(value, list) else (value,)
        if {"params", "param"} & {*self.typed} and "params" not in more:
            options["params"] = self._values(valid, signature.bind_partial(*positional).arguments)
        if "progress" in signature.parameters:
            options["progress"] = self.progress
        return function(*positional, **options | more)

    def _values(self, valid: Mapping[str, Argument], values: Mapping[str, Any]) -> dict[str, Any]:
        """Parameter values of the only estimator, or by estimator."""
        names: list[Named] = []
        several = False
        for name, value in values.items():
            if valid[name].option in (_ESTIMATOR, _SEVERAL):
                several |= valid[name].option == _SEVERAL
                names += value if isinstance(value, tuple) else [value]
        names = estimator_names(*names) if several else names
        if len(names) == 1:
            return values_for(names[0], *self.params)
        return dict(params_for_each(names, *self.params))


def outcome(result: Any, text: str = "") -> Outcome:
    """The outcome of a result, with more text for people: 1 unless it is good."""
    return int(not getattr(result, "good", True)), result.to_json(), f"{result}{text}"


class Verb:
    """A verb of the command line.

    Parameters
    ----------
    modes : functions
        Functions whose parameters are its arguments and options.
    call : callable, optional
        From `Arguments` to an outcome, where there are several modes or something more to say; its
        own parameters are arguments too, positional ones instead of those of the modes.
    """

    def __init__(
        self, *modes: Callable[..., Any], call: Callable[..., Outcome] | None = None
    ) -> None:
        self.modes = modes
        self.call = call

    @cached_property
    def call_arguments(self) -> dict[str, Argument]:
        """Arguments of ``call`` itself."""
        return {} if self.call is None else arguments_of(self.call)

    @cached_property
    def arguments(self) -> dict[str, Argument]:
        """All its arguments, by name."""
        argument_sets = [self.call_arguments, *map(arguments_of, self.modes)]
        first = next((a for a in argument_sets if any(not x.flags for x in a.values())), {})
        positional = {name: a for name, a in first.items() if not a.flags}
        for arguments in argument_sets:
            options = {name: a for name, a in arguments.items() if a.flags}
            positional |= {name: a for name, a in options.items() if name not in positional}
        return positional

    def run(self, parsed: Mapping[str, Any]) -> Outcome:
        """Run it with the result of argparse."""
        typed = {name: value for name, value in parsed.items() if name in self.arguments}
        arguments = Arguments(self.arguments, typed, json=parsed["json"], quiet=parsed["quiet"])
        if self.call is None:
            return outcome(arguments.call(*self.modes))
        positional: list[Any] = []
        keywords: dict[str, Any] = {}
        for name in [name for name in self.call_arguments if name in typed]:
            value = typed.pop(name)
            if self.call_arguments[name].flags:
                keywords[name] = value
            else:
                positional += value if isinstance(value, list) else [value]
        return self.call(arguments, *positional, **keywords)
