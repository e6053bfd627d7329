"""What verbs share: options of the command line, and what they become."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from boresight.disk.paths import refuse_inputs
from boresight.model.errors import InputError
from boresight.model.resolve import Named
from boresight.parameters import values_for
from boresight.sharing import params_for_each
from boresight.terminal import tell

__all__ = [
    "PROFILED",
    "Outcome",
    "chosen_profiles",
    "model_options",
    "number_options",
    "params_of",
    "profile_options",
    "progress_of",
    "refuse_options",
]

#: Exit code, data for ``--json``, text for people.
Outcome: TypeAlias = tuple[int, Any, str]


#: Verbs that compile estimators, and so take profiles.
PROFILED = (
    *("compile", "run", "check", "report", "simulate", "demo"),
    *("accuracy", "bench", "covariance", "montecarlo", "tune"),
)


def profile_options(parser: ArgumentParser) -> None:
    """Where formats come from beside intervals."""
    parser.add_argument(
        "--profile",
        action="append",
        default=[],
        metavar="FILE",
        help="ranges for formats, as fit writes them, repeatable; default: beside the estimator",
    )
    parser.add_argument("--no-profile", action="store_true", help="formats by intervals alone")


def chosen_profiles(args: Namespace) -> list[str] | None:
    """Files of profiles; None: those beside the estimators' files.

    Raises
    ------
    InputError
        Files together with ``--no-profile``.
    """
    files: list[str] = getattr(args, "profile", [])
    if getattr(args, "no_profile", False):
        if files:
            raise InputError.at(
                "--profile",
                wanted="a profile, or --no-profile",
                found="both",
                fix="leave one of them out",
            )
        return []
    return files or None


def number_options(parser: ArgumentParser) -> None:
    """Word width and parameter values."""
    parser.add_argument("--word", type=int, default=32, help="word width, 18 to 32 bits")
    parser.add_argument(
        "--params",
        action="append",
        default=[],
        metavar="FILE.json",
        help="parameter values, as tune writes them, repeatable",
    )
    parser.add_argument(
        "--param",
        action="append",
        default=[],
        metavar="NAME=NUMBER",
        help="parameter value, repeatable, on top of the files",
    )


def model_options(parser: ArgumentParser) -> None:
    """Configuration of the core, word width, parameter values."""
    parser.add_argument(
        "--config",
        default="small",
        help="small (one lane), fast (two lanes), small-1024 or fast-1024 (twice the registers)",
    )
    number_options(parser)


def params_of(args: Namespace, names: Sequence[Named]) -> dict[str, Any]:
    """Parameter values of the only estimator, or by estimator.

    Raises
    ------
    InputError
        A wrong name or value, a bad file, or one that is also the output.
    """
    for option, name in (("-o", "output"), ("--reproducer", "reproducer")):
        refuse_inputs(getattr(args, name, None) or "", args.params, option)
    if len(names) > 1:
        return dict(params_for_each(names, args.params, args.param))
    return dict(values_for(names[0], args.params, args.param))


def refuse_options(
    args: Namespace,
    add_arguments: Callable[[ArgumentParser], None],
    names: Sequence[str],
    *,
    wanted: str,
    found: str,
    instead: str = "",
) -> None:
    """Refuse options of a verb that have no meaning beside others.

    Parameters
    ----------
    add_arguments : callable
        The verb's, for their defaults.
    names : sequence of str
        Names of the options in ``args``.
    wanted, found : str
        What the options belong to, and what is run.
    instead : str
        What else could be done, before "leave it out".

    Raises
    ------
    InputError
        One of them has another value than its default.
    """
    parser = ArgumentParser(add_help=False)
    add_arguments(parser)
    for name in names:
        if getattr(args, name) != parser.get_default(name):
            option = f"--{name.replace('_', '-')}"
            fix = f"{instead}leave {option} out"
            raise InputError.at(option, wanted=wanted, found=found, fix=fix)


def progress_of(args: Namespace) -> Callable[[str], None] | None:
    """What progress is told to: stderr, unless ``--quiet`` or ``--json``."""
    return None if args.quiet or args.json else tell
