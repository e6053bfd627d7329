"""Arguments and options that several verbs take, and estimators and parameter values from them.

A verb is a function: cyclopts makes its command line from the annotations and the docstring. The
aliases below are annotations. Options that the command line alone adds to a verb, since they hold
for everything that the verb reads, are parameters of functions that return settings
(`boresight.cli`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from cyclopts import Parameter

from boresight.gateware.description import Description
from boresight.model.errors import InputError, require
from boresight.model.resolve import Named, estimator_of, split_names
from boresight.model.tools.reading import Malformed, kind_of, read_json, typed
from boresight.sim.records.selection import Selection
from boresight.sim.result import EARLIER, Result
from boresight.sim.result import baseline as compared


def _plain(converter: Callable[..., Any], **settings: Any) -> Parameter:
    return Parameter(converter=converter, n_tokens=1, accepts_keys=False, negative=(), **settings)


def _text(kind: Any, tokens: Sequence[Any]) -> Any:
    return tokens[0].value


def _texts(kind: Any, tokens: Sequence[Any]) -> Any:
    return [token.value for token in tokens]


def _split(kind: Any, tokens: Sequence[Any]) -> Any:
    return [text for token in tokens for text in token.value.split(",")]


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


def rows(
    *,
    start: Annotated[
        str | None,
        Parameter(name="--from", help="Start of the slice of each log, for example 10s."),
    ] = None,
    stop: Annotated[
        str | None, Parameter(name="--to", help="End of the slice of each log.")
    ] = None,
    every: Annotated[
        int | None, Parameter(help="Use every n-th row; its time step is that of n rows.")
    ] = None,
    gaps: Annotated[
        str | None,
        Parameter(
            help="refuse or restart, at steps above three medians; by default a gap is one step."
        ),
    ] = None,
    map: Annotated[
        str | None,
        Parameter(
            metavar="FILE.toml", help="File that maps topics of a flight log or bag to columns."
        ),
    ] = None,
) -> dict[str, Any]:
    """Which rows of log files are read."""
    values = start, stop, every, gaps, map
    return {} if {*values} == {None} else {"rows": Selection.of(*values)}


def profiles(
    *,
    profile: Annotated[
        Sequence[str] | None,
        _plain(
            _texts,
            metavar="FILE|none",
            help="Profile that fit wrote; by default the one beside the estimator; repeatable.",
        ),
    ] = None,
) -> dict[str, Any]:
    """Which profiles of `boresight fit` choose the formats."""
    files = [] if profile == ["none"] else profile
    return {} if files is None else {"profiles": tuple(files)}


def tolerances(
    *,
    tolerance: Annotated[
        Sequence[str],
        _plain(
            _texts,
            metavar="OUTPUT=NUMBER",
            help="Accepted error of an output, in place of the declared one; repeatable.",
        ),
    ] = (),
) -> dict[str, Any]:
    """Which errors are accepted."""
    return {"tolerances": tuple(tolerance)}


def judged(
    *,
    baseline: Annotated[
        str | None,
        Parameter(
            metavar="FILE",
            help="An earlier result, from --json: fail if a figure is worse than accepted.",
        ),
    ] = None,
) -> dict[str, Any]:
    """With which earlier result the result is compared."""
    if baseline is not None and not Path(baseline).is_fifo():  # which gives its text once
        read_json(baseline, EARLIER)  # a damaged file is told before the work
    return {"baseline": baseline}


def with_baseline(result: Result, file: str | None) -> Result:
    """A result, and what has changed since an earlier one."""
    if file is None:
        return result
    found = compared(result, file)
    return replace(
        result,
        data={**result.data, "baseline": found.to_json()},
        summary=f"{result.summary}\n{found.summary}",
        tables={**result.tables, **found.tables},
        notes=(*result.notes, *found.notes),
        failures=(*result.failures, *found.failures),
    )


def estimator_names(*texts: Named) -> list[Named]:
    """Split texts of one or several names with commas; InputError for one unknown, or twice."""
    names: list[Named] = []
    for text in texts:
        names += split_names(text) if isinstance(text, str) else [text]
    for name, times in Counter(estimator_of(text).name for text in names).items():
        fix = "leave one out, or rename one"
        require(times == 1, "estimators", "each name once", f"{name} twice", fix)
    return names


def params_of(
    name: Named, params: Mapping[str, Any] | Sequence[str] | None
) -> Mapping[str, float] | None:
    """Parameter values of one estimator, as `params_of_each`."""
    return params_of_each([name], params)[0]


def params_of_each(
    names: Sequence[Named],
    params: Mapping[str, Any] | Sequence[str] | None,
    besides: Sequence[Named] = (),
) -> list[Mapping[str, float] | None]:
    """Parameter values of each estimator of ``names``, then of ``besides``.

    Values are a mapping by name (of one estimator), mappings by estimator, or texts
    ``NAME=NUMBER``, with several estimators ``ESTIMATOR.NAME=NUMBER``, and ``@FILE``. A file is one
    JSON object: values by name, or those under ``parameters`` and the estimator's name under
    ``estimator``, as `boresight tune -o` writes it, or values by estimator, as `boresight fit
    board` does; or the ``registers.json`` of a core or board, for the values that it is compiled
    with. ``besides`` are further programs of the core; names without an estimator are never theirs.
    Raises InputError for values of another estimator, and for a bad file, name or value.
    """
    estimators = {e.name: e for e in map(estimator_of, names)}
    only = next(iter(estimators)) if len(estimators) == 1 else None
    estimators |= {e.name: e for e in map(estimator_of, besides)}
    values: dict[str, dict[str, float]] = {}
    for where, owner, some in _given(params, only, estimators):
        if owner not in estimators or not isinstance(some, Mapping):
            found = "no estimator's name" if owner is None else str(owner)
            wanted = f"values of {', '.join(estimators)}"
            fix = f"write for example --param {only or next(iter(estimators))}.NAME=NUMBER"
            raise InputError.at(where, wanted=wanted, found=found, fix=fix)
        values[owner] = {**values.get(owner, {}), **some}
        estimators[owner].param_values(values[owner])
    return [values.get(name) for name in estimators]


def _given(
    params: Mapping[str, Any] | Sequence[str] | None, only: str | None, names: Iterable[str]
) -> Iterator[tuple[str, str | None, Any]]:
    """Where values were given, the estimator that they belong to, and the values."""
    if isinstance(params, Mapping):
        items = {only: params} if only and [*params] != [only] else params
        yield from (("parameters", name, values) for name, values in items.items())
        return
    for text in params or ():
        if text.startswith("@"):
            for owner, some in _read(text[1:], names):
                yield text[1:], owner or only, some
        else:
            ((name, value),) = numbers([text]).items()
            owner, dot, rest = name.rpartition(".")
            yield f"--param {name}", owner if dot else only, {rest: value}


def numbers(texts: Sequence[str], option: str = "--param") -> dict[str, float]:
    """Values of ``NAME=NUMBER`` texts, or InputError; the last text of a name counts."""
    out = {}
    for text in texts:
        name, _, number = text.partition("=")
        try:
            out[name] = float(number)
        except ValueError:
            fix = f"write for example {option} NAME=0.5"
            raise InputError.at(option, wanted="NAME=NUMBER", found=repr(text), fix=fix) from None
    return out


def _read(path: str, names: Iterable[str]) -> Iterator[tuple[str | None, dict[str, float]]]:
    """Estimators (None if the file has none) and values of a parameter file."""
    data = read_json(path, "a parameter file")
    name, values = None, data
    if isinstance(data, dict) and "registers" in data:
        try:
            described = typed(Description, data)
        except Malformed as error:
            where, found = f"{path}{error.location}", kind_of(error.value)
            wanted, fix = "a registers.json of `boresight compile`", "compile again"
            raise InputError.at(where, wanted=wanted, found=found, fix=fix) from None
        programs = [p.program for p in described.programs]
        owners = [n for n in names if n in programs] or programs
        yield from ((n, described.parameters_of(n)) for n in owners)
        return
    if isinstance(data, dict) and "parameters" in data:
        name, values = data.get("estimator"), data["parameters"]
    groups = {name: values}
    if isinstance(values, dict) and any(isinstance(v, dict) for v in values.values()):
        groups = {n: v for n, v in values.items() if n in names} or values
    for owner, some in groups.items():
        if not isinstance(some, dict) or not (owner is None or isinstance(owner, str)):
            wanted = "a JSON object with parameter values"
            fix = 'write for example {"kp_pitch_per_s": 0.5}'
            raise InputError.at(path, wanted=wanted, found=kind_of(some), fix=fix)
        for key, value in some.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                where, found = f"{path}, {key}", kind_of(value)
                raise InputError.at(where, wanted="a number", found=found, fix="correct the file")
        yield owner, some
