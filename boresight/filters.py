"""Attitude filters by name, ours and published ones, and the parameters that are meant for each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.estimators import ESTIMATORS
from boresight.model.estimators.nine_axis import INPUTS
from boresight.model.resolve import Named, estimator_of, split_names
from boresight.parameters import values_for
from boresight.sharing import params_for_each
from boresight.sim.accuracy.peers import PEERS

__all__ = ["chosen", "groups", "params_by_estimator"]


def groups() -> dict[str, list[str]]:
    """Words that stand for several names; ours are those that take what the published ones do."""
    ours = [name for name, kind in ESTIMATORS.items() if kind.inputs == INPUTS]
    return {"ours": ours, "published": list(PEERS), "all": [*ours, *PEERS]}


def chosen(names: Named | Sequence[Named]) -> tuple[list[Named], list[str]]:
    """Estimators and peers of names; a text holds one or several with commas, and of `groups`.

    Raises
    ------
    InputError
        A name twice, or none.
    """
    known = groups()
    every: list[Named] = []
    for name in [names] if isinstance(names, str | Estimator | type) else names:
        for text in split_names(name) if isinstance(name, str) else [name]:
            every += known.get(text, [text]) if isinstance(text, str) else [text]
    twice = [n for k, n in enumerate(every) if isinstance(n, str) and n in every[:k]]
    if twice or not every:
        raise InputError.at(
            "estimators",
            wanted="at least one, each once",
            found=f"{twice[0]} twice" if twice else "none",
            fix=f"name some, or one of {', '.join(known)}",
        )
    peers = [n for n in every if isinstance(n, str) and n in PEERS]
    return [n for n in every if n not in peers], peers


def params_by_estimator(
    names: Sequence[Named], files: Sequence[str | Path] = (), settings: Sequence[str] = ()
) -> dict[str, dict[str, float]]:
    """Parameter values by estimator, of files and ``[ESTIMATOR.]NAME=NUMBER`` texts.

    A file that names its estimator is for that one; values of nobody need a single estimator.

    Raises
    ------
    InputError
        Values whose estimator is unknown or not among ``names``.
    """
    if (files or settings) and not names:
        raise InputError.at(
            "parameters",
            wanted="estimators of ours or yours",
            found="published filters only",
            fix="name an estimator, or leave the values out",
        )
    if len(names) != 1:
        return params_for_each(names, files, settings)
    values = values_for(names[0], files, settings)
    return {estimator_of(names[0]).name: values} if values else {}
