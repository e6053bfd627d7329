"""Arguments and options that several verbs take.

A verb is a function: cyclopts makes its command line from the annotations and the docstring. The
aliases below are annotations; the classes are groups of options that the command line alone adds
to a verb, since they hold for everything that the verb reads (`boresight.cli`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from cyclopts import Parameter

from boresight.model.resolve import Named


def _text(kind: Any, tokens: Sequence[Any]) -> Any:
    """The only text of an argument."""
    return tokens[0].value


def _texts(kind: Any, tokens: Sequence[Any]) -> Any:
    """All texts of an option that may be repeated."""
    return [token.value for token in tokens]


def _split(kind: Any, tokens: Sequence[Any]) -> Any:
    """Texts with commas between them."""
    return [text for token in tokens for text in token.value.split(",")]


def _plain(converter: Callable[..., Any], **settings: Any) -> Parameter:
    """A parameter of texts that are converted by us."""
    return Parameter(converter=converter, n_tokens=1, accepts_keys=False, negative=(), **settings)


#: A parameter for Python alone.
PythonOnly = Parameter(parse=False)
#: Texts with commas between them.
Texts = _plain(_split)
#: An option that is given once for each text.
Repeated = _plain(_texts)

#: The text of an experiment.
ExperimentName = _plain(_text, metavar="NAME|FILE.py:CLASS")
#: The text of a world.
WorldName = _plain(_text, help="FILE.py:CLASS, or the name of a world.", metavar="WORLD")

EstimatorName: TypeAlias = Annotated[
    Named, _plain(_text, help="Name, FILE.py, or FILE.py:CLASS.", metavar="ESTIMATOR")
]
EstimatorNames: TypeAlias = Annotated[
    Named,
    _plain(
        _text,
        help="Name, FILE.py, or FILE.py:CLASS; several with commas.",
        metavar="ESTIMATOR[,ESTIMATOR...]",
    ),
]
Logs: TypeAlias = Annotated[
    Any, _plain(_text, help="Logs, or folders of logs.", metavar="LOG", show_default=False)
]
Config: TypeAlias = Annotated[
    str,
    Parameter(
        help="Machine: small (one lane) or fast (two lanes); then -1024 or -2048 for two or four "
        "times the registers; then -d9, -d10 or -d12 for a deeper pipeline."
    ),
]
Word: TypeAlias = Annotated[int, Parameter(help="Word width in bits, 18 to 32.")]
Level: TypeAlias = Annotated[Sequence[str], _plain(_split, name="--levels", metavar="FORM,...")]
Steps: TypeAlias = Annotated[
    int | None, Parameter(help="Use at most this many samples of each source.")
]
Jobs: TypeAlias = Annotated[
    int | None, Parameter(help="Number of tasks at a time; by default one for each processor.")
]
Scheduler: TypeAlias = Annotated[str | None, Parameter(metavar="ADDRESS")]
OutputFolder: TypeAlias = Annotated[
    str | Path, Parameter(name=["--output", "-o"], help="Folder for the files.", metavar="DIR")
]
OptionalFolder: TypeAlias = Annotated[
    str | Path | None,
    Parameter(name=["--output", "-o"], help="Folder for the page and its JSON.", metavar="DIR"),
]
OptionalFile: TypeAlias = Annotated[
    str | Path | None, Parameter(name=["--output", "-o"], metavar="FILE")
]
Params: TypeAlias = Annotated[
    Mapping[str, Any] | Sequence[str] | None,
    _plain(
        _texts,
        name="--param",
        metavar="NAME=NUMBER|@FILE",
        help="Value of a parameter, or a file of tune or fit board, or registers.json; repeatable.",
    ),
]
Progress: TypeAlias = Annotated[Callable[[str], None] | None, PythonOnly]


class Group:
    """Options that hold for all that a verb does."""

    def settings(self) -> dict[str, Any]:
        """Settings (`model.settings`) with which the verb runs."""
        return {}

    def judged(self, result: Any) -> Any:
        """The result as it is told."""
        return result


@Parameter(name="*", negative=())
@dataclass(frozen=True)
class LogRows(Group):
    """Which rows of log files are read."""

    start: Annotated[
        str | None,
        Parameter(name="--from", help="Start of the slice of each log, for example 10s."),
    ] = None
    stop: Annotated[str | None, Parameter(name="--to", help="End of the slice of each log.")] = None
    every: Annotated[
        int | None, Parameter(help="Use every n-th row; its time step is that of n rows.")
    ] = None
    gaps: Annotated[
        str | None,
        Parameter(
            help="refuse or restart, at steps above three medians; by default a gap is one step."
        ),
    ] = None
    map: Annotated[
        str | None,
        Parameter(
            metavar="FILE.toml", help="File that maps topics of a flight log or bag to columns."
        ),
    ] = None

    def settings(self) -> dict[str, Any]:
        """Reads of log files select these rows."""
        values = astuple(self)
        if {*values} == {None}:
            return {}
        from boresight.sim.records.selection import Selection

        return {"rows": Selection.of(*values)}


@Parameter(name="*")
@dataclass(frozen=True)
class Profiles(Group):
    """Which profiles of `boresight fit` choose the formats."""

    profile: Annotated[
        Sequence[str] | None,
        _plain(
            _texts,
            name="--profile",
            metavar="FILE|none",
            help="Profile that fit wrote; by default the one beside the estimator; repeatable.",
        ),
    ] = None

    def settings(self) -> dict[str, Any]:
        """Estimators take these profiles."""
        files = [] if self.profile == ["none"] else self.profile
        return {} if files is None else {"profiles": tuple(files)}


@Parameter(name="*")
@dataclass(frozen=True)
class Tolerances(Group):
    """Which errors are accepted."""

    tolerance: Annotated[
        Sequence[str],
        _plain(
            _texts,
            name="--tolerance",
            metavar="OUTPUT=NUMBER",
            help="Accepted error of an output, in place of the declared one; repeatable.",
        ),
    ] = ()

    def settings(self) -> dict[str, Any]:
        """Outputs are judged by these tolerances."""
        return {"tolerances": tuple(self.tolerance)}


@Parameter(name="*")
@dataclass(frozen=True)
class Baseline(Group):
    """With which earlier result the result is compared."""

    baseline: Annotated[
        str | None,
        Parameter(
            name="--baseline",
            metavar="FILE",
            help="An earlier result, from --json: fail if a figure is worse than accepted.",
        ),
    ] = None

    def judged(self, result: Any) -> Any:
        """The result, and what has changed since the earlier one."""
        if self.baseline is None:
            return result
        from boresight.sim.baseline import baseline

        found = baseline(result, self.baseline)
        return replace(
            result,
            data={**result.data, "baseline": found.to_json()},
            summary=f"{result.summary}\n{found.summary}",
            tables={**result.tables, **found.tables},
            notes=(*result.notes, *found.notes),
            failures=(*result.failures, *found.failures),
        )
