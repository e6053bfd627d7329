"""Attitude filters by name, shipped and published ones, and parameter values for each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.nine_axis import INPUTS
from boresight.model.resolve import ESTIMATOR_GROUP, Named, estimator_of, offered, split_names
from boresight.parameters import values_for
from boresight.sharing import params_for_each
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
    names: Sequence[Named], files: Sequence[str | Path] = (), settings: Sequence[str] = ()
) -> dict[str, dict[str, float]]:
    """Return parameter values by estimator, from files and ``[ESTIMATOR.]NAME=NUMBER`` texts.

    A file may name its estimator; values without an estimator's name need a single estimator.

    Raises
    ------
    InputError
        Values whose estimator is unknown or not among ``names``.
    """
    if (files or settings) and not names:
        raise InputError.at(
            "parameters",
            wanted="an estimator with parameters",
            found="published filters only",
            fix="name an estimator, or leave the values out",
        )
    if len(names) != 1:
        return params_for_each(names, files, settings)
    values = values_for(names[0], files, settings)
    return {estimator_of(names[0]).name: values} if values else {}
