"""Several estimators in one core: their names and parameters, as users give them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimators import estimator as find_estimator
from boresight.parameters import parse_settings, read_params

__all__ = ["estimator_names", "params_for_each", "params_of_each"]


def estimator_names(*texts: str) -> list[str]:
    """Names of estimators, each text one or several with commas.

    Raises
    ------
    InputError
        Unknown name, or one that is named twice.
    """
    names = [name for text in texts for name in text.split(",")]
    for k, name in enumerate(names):
        find_estimator(name)
        if name in names[:k]:
            raise InputError.at(
                "estimators",
                wanted="each name once",
                found=f"{name} twice",
                fix="leave one out: a core holds one program of each",
            )
    return names


def params_of_each(
    names: Sequence[str], params: Mapping[str, Any] | None
) -> list[Mapping[str, float] | None]:
    """Parameter values of each estimator.

    Parameters
    ----------
    params : mapping or None
        For one estimator its values by name; for several, such a mapping by estimator.

    Raises
    ------
    InputError
        Values of an estimator that is not among them, or not by estimator.
    """
    if len(names) == 1 or not params:
        return [params for _ in names]
    for name, values in params.items():
        if name not in names or not isinstance(values, Mapping):
            raise InputError.at(
                "parameters",
                wanted=f"values of {', '.join(names)}",
                found=name,
                fix=f"write for example --param {names[0]}.NAME=NUMBER",
            )
    return [params.get(name) for name in names]


def params_for_each(
    names: Sequence[str], files: Sequence[str | Path], settings: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Values by estimator: of files that name theirs, then of ``ESTIMATOR.NAME=NUMBER`` texts.

    Raises
    ------
    InputError
        Whose values they are is not said, or it is none of ``names``; a bad file, name or value.
    """
    out: dict[str, dict[str, float]] = {}

    def take(where: str, owner: str | None, values: Mapping[str, float]) -> None:
        if owner not in names:
            raise InputError.at(
                where,
                wanted=f"parameters of {', '.join(names)}",
                found="no estimator's name" if owner is None else f"those of {owner}",
                fix=f"write for example --param {names[0]}.NAME=NUMBER",
            )
        assert owner is not None
        out[owner] = out.get(owner, {}) | dict(values)

    for path in files:
        take(str(path), *read_params(path))
    for full, value in parse_settings(settings).items():
        owner, dot, name = full.partition(".")
        take(f"--param {full}", owner if dot else None, {name: value})
    for owner, values in out.items():
        find_estimator(owner).param_values(values)
    return out
