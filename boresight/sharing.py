"""Names and parameters of several estimators in one core, from arguments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.model.resolve import Named, split_names
from boresight.model.resolve import estimator_of as find_estimator
from boresight.parameters import parse_settings, read_params

__all__ = ["estimator_names", "params_for_each", "params_of_each"]


def estimator_names(*texts: Named) -> list[Named]:
    """Split texts of one or several names with commas.

    Raises
    ------
    InputError
        A name is unknown or occurs twice.
    """
    names: list[Named] = []
    for text in texts:
        names += split_names(text) if isinstance(text, str) else [text]
    accepted: list[str] = []
    for text in names:
        name = find_estimator(text).name
        if name in accepted:
            raise InputError.at(
                "estimators",
                wanted="each name once",
                found=f"{name} twice",
                fix="leave one out: a core holds one program of each",
            )
        accepted.append(name)
    return names


def params_of_each(
    names: Sequence[Named], params: Mapping[str, Any] | None
) -> list[Mapping[str, float] | None]:
    """Parameter values of each estimator.

    Parameters
    ----------
    params : mapping or None
        For one estimator its values by name; for several, such a mapping by estimator.

    Raises
    ------
    InputError
        Values of an estimator that is not among ``names``, or not by estimator.
    """
    if len(names) == 1 or not params:
        return [params for _ in names]
    owners = [find_estimator(n).name for n in names]
    for name, values in params.items():
        if name not in owners or not isinstance(values, Mapping):
            raise InputError.at(
                "parameters",
                wanted=f"values of {', '.join(owners)}",
                found=name,
                fix=f"write for example --param {owners[0]}.NAME=NUMBER",
            )
    return [params.get(name) for name in owners]


def params_for_each(
    names: Sequence[Named], files: Sequence[str | Path], settings: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Values by estimator: from files that name theirs, then from ``ESTIMATOR.NAME=NUMBER`` texts.

    Raises
    ------
    InputError
        Values without an estimator of ``names``; a bad file, name or value.
    """
    out: dict[str, dict[str, float]] = {}
    estimators = {e.name: e for e in map(find_estimator, names)}

    def add_values(where: str, owner: str | None, values: Mapping[str, float]) -> None:
        if owner not in estimators:
            raise InputError.at(
                where,
                wanted=f"parameters of {', '.join(estimators)}",
                found="no estimator's name" if owner is None else f"those of {owner}",
                fix=f"write for example --param {next(iter(estimators))}.NAME=NUMBER",
            )
        assert owner is not None
        out[owner] = out.get(owner, {}) | dict(values)

    for path in files:
        add_values(str(path), *read_params(path))
    for full, value in parse_settings(settings).items():
        owner, dot, name = full.partition(".")
        add_values(f"--param {full}", owner if dot else None, {name: value})
    for owner, values in out.items():
        estimators[owner].param_values(values)
    return out
