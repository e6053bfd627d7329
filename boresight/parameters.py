"""Estimators and their parameter values as verbs take them.

Values come from Python as a mapping; from the command line as texts ``NAME=NUMBER`` or ``@FILE``.
A file is one JSON object: values by name, or an object with those under ``parameters`` and the
estimator's name under ``estimator``, as `boresight tune -o` writes it, or values by estimator, as
`boresight fit board` does; or the ``registers.json`` of a core or board, for the values that it is
compiled with. With several estimators a name has its estimator before it, as in
``mekf.gyro_noise=0.1``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from boresight.gateware.description import Description
from boresight.model.errors import InputError, require
from boresight.model.resolve import Named, split_names
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.tools.typed import Malformed, typed
from boresight.sim.records.reading import kind_of, read_json


def estimator_names(*texts: Named) -> list[Named]:
    """Split texts of one or several names with commas; InputError for one unknown, or twice."""
    names: list[Named] = []
    for text in texts:
        names += split_names(text) if isinstance(text, str) else [text]
    accepted: list[str] = []
    for text in names:
        name = find_estimator(text).name
        fix = "leave one out, or rename one"
        require(name not in accepted, "estimators", "each name once", f"{name} twice", fix)
        accepted.append(name)
    return names


def params_of(
    name: Named, params: Mapping[str, Any] | Sequence[str] | None
) -> Mapping[str, float] | None:
    """Parameter values of one estimator; see `params_of_each`."""
    return params_of_each([name], params)[0]


def params_of_each(
    names: Sequence[Named],
    params: Mapping[str, Any] | Sequence[str] | None,
    besides: Sequence[Named] = (),
) -> list[Mapping[str, float] | None]:
    """Parameter values of each estimator of ``names``, then of ``besides``.

    Parameters
    ----------
    params : mapping, sequence of str or None
        For one estimator its values by name; for any, such a mapping by estimator; or texts.
    besides : sequence of str, class or Estimator
        Further programs of the core; names without an estimator are never theirs.

    Raises
    ------
    InputError
        Values of an estimator that is not among ``names``; a bad file, name or value.
    """
    estimators = {e.name: e for e in map(find_estimator, names)}
    only = next(iter(estimators)) if len(estimators) == 1 else None
    estimators |= {e.name: e for e in map(find_estimator, besides)}
    values: dict[str, dict[str, float]] = {}
    for where, owner, some in _given(params, only, estimators):
        if owner not in estimators or not isinstance(some, Mapping):
            raise InputError.at(
                where,
                wanted=f"values of {', '.join(estimators)}",
                found="no estimator's name" if owner is None else str(owner),
                fix=f"write for example --param {only or next(iter(estimators))}.NAME=NUMBER",
            )
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
            raise InputError.at(
                f"{path}{error.location}",
                wanted="a registers.json of `boresight compile`",
                found=kind_of(error.value),
                fix="compile again",
            ) from None
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
            raise InputError.at(
                path,
                wanted="a JSON object with parameter values",
                found=kind_of(some),
                fix='write for example {"kp_pitch_per_s": 0.5}',
            )
        for key, value in some.items():
            if isinstance(value, bool) or not isinstance(value, int | float):
                where, found = f"{path}, {key}", kind_of(value)
                raise InputError.at(where, wanted="a number", found=found, fix="correct the file")
        yield owner, some
