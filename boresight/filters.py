"""Attitude filters by name, shipped and published ones, and parameter values for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, offered, split_names
from boresight.parameters import params_of_each
from boresight.sim.accuracy.peers import PEERS

__all__ = ["chosen", "groups", "params_by_estimator"]


def groups() -> dict[str, list[str]]:
    """Words for several names; "ours" are estimators with the inputs of the published filters."""
    installed, _ = offered(Estimator, "estimator", ESTIMATOR_GROUP)
    ours = [name for name, kind in installed.items() if kind.inputs == INPUTS]
    return {"ours": ours, "published": list(PEERS), "all": [*ours, *PEERS]}


def chosen(names: Named | Sequence[Named]) -> tuple[list[Named], list[str]]:
    """Split names into estimators and published filters.

    A text holds one or several names with commas, or words of `groups`.

    Raises
    ------
    InputError
        A name twice, or none.
    """
    words = groups()
    members: list[Named] = []
    for name in [names] if isinstance(names, str | Estimator | type) else names:
        for text in split_names(name) if isinstance(name, str) else [name]:
            members += words.get(text, [text]) if isinstance(text, str) else [text]
    duplicates = [n for k, n in enumerate(members) if isinstance(n, str) and n in members[:k]]
    if duplicates or not members:
        raise InputError.at(
            "estimators",
            wanted="at least one, each once",
            found=f"{duplicates[0]} twice" if duplicates else "none",
            fix=f"name some, or one of {', '.join(words)}",
        )
    published = [n for n in members if isinstance(n, str) and n in PEERS]
    return [n for n in members if n not in published], published


def params_by_estimator(
    names: Sequence[Named], params: Mapping[str, Any] | Sequence[str] | None
) -> dict[str, Mapping[str, float]]:
    """Parameter values by estimator: from Python by estimator, or texts of the command line.

    Raises
    ------
    InputError
        Values whose estimator is unknown or not among ``names``.
    """
    if params and not names:
        raise InputError.at(
            "parameters",
            wanted="an estimator with parameters",
            found="published filters only",
            fix="name an estimator, or leave the values out",
        )
    own = [estimator_of(name).name for name in names]
    if isinstance(params, Mapping) and len(own) == 1 and own[0] in params:
        params = params[own[0]]
    values = params_of_each(names, params)
    return {name: some for name, some in zip(own, values, strict=True) if some}
