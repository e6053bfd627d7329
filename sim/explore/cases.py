"""The combinations of an exploration: arguments of the constructor, word, machine, target."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.model.errors import InputError, require
from boresight.model.resolve import Named, estimator_of, split_names
from boresight.sim.levels.build import Build
from boresight.sim.records.record import Record
from boresight.sim.worlds.world import NamedWorld

_ARGUMENT = re.compile(r"[A-Za-z_]\w*=")


@dataclass(frozen=True)
class Case:
    """A combination of word, machine and target.

    ``arguments`` are names and values of the estimator's constructor, as Python writes them.
    """

    estimator: Named
    arguments: tuple[tuple[str, str], ...]
    word: int
    config: str
    target: str

    @property
    def name(self) -> str:
        """Name that distinguishes it from other combinations."""
        arguments = [f"{key}={value}" for key, value in self.arguments]
        return ", ".join([*arguments, f"{self.word} bits", self.config, self.target])

    @property
    def named(self) -> Named:
        """The estimator with the arguments of its constructor.

        Raises
        ------
        InputError
            There is no name.
        """
        name, text = self.estimator, ", ".join(f"{key}={value}" for key, value in self.arguments)
        if not text:
            return name
        if not isinstance(name, str):
            raise InputError.at(
                "estimator",
                wanted="a name, as FILE.py:CLASS, with arguments of the constructor",
                found="an object of Python",
                fix="give its name, or leave the arguments out",
            )
        if name.endswith(")"):
            return f"{name[:-1]}{'' if name.endswith('()') else ', '}{text})"
        if name.endswith(".py"):
            name = f"{name}:{type(estimator_of(name)).__name__}"
        return f"{name}({text})"

    def build(self, exploration: Exploration) -> Build:
        """The build to measure; raises `InputError` as `named` and `Build` do."""
        params = [dict(exploration.params)]
        return Build(estimator_of(self.named), config=self.config, word=self.word, params=params)


@dataclass(frozen=True)
class Exploration:
    """Settings of all combinations.

    Each world with the combination's estimator in float64 gives one more log. Of each log the first
    ``steps`` samples count. ``seeds`` are the router's; ``digest`` is that of the logs when the
    exploration began.
    """

    logs: tuple[str | Record, ...]
    worlds: tuple[NamedWorld, ...] = ()
    params: tuple[tuple[str, float], ...] = ()
    steps: int | None = None
    seeds: int = 1
    digest: str = ""


def arguments_of(texts: Sequence[Any]) -> tuple[list[Any], dict[str, list[Any]]]:
    """Logs, and values of the constructor's arguments by name, written ``NAME=VALUE,VALUE``.

    Raises
    ------
    InputError
        A name twice, or a value that is no literal of Python.
    """
    logs: list[Any] = []
    arguments: dict[str, list[Any]] = {}
    for text in texts:
        if not isinstance(text, str) or not _ARGUMENT.match(text):
            logs.append(text)
            continue
        name, _, values = text.partition("=")
        require(name not in arguments, text, "each argument once", name, "join both")
        arguments[name] = [_literal(text, value.strip()) for value in split_names(values)]
    return logs, arguments


def _literal(text: str, value: str) -> Any:
    try:
        return ast.literal_eval(value)
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        fix = "write for example taps=4,8,16"
        require(value.isidentifier(), text, "values of an argument, with commas", value, fix)
        return value


def cases_of(
    name: Named,
    arguments: Mapping[str, Sequence[Any]],
    *,
    words: Sequence[int],
    configs: Sequence[str],
    targets: Sequence[str],
) -> list[Case]:
    """Every combination, once."""
    values = itertools.product(*arguments.values())
    argument_sets = [tuple(zip(arguments, map(repr, v), strict=True)) for v in values]
    product = itertools.product(argument_sets, targets, configs, words)
    return [
        *dict.fromkeys(Case(name, a, word, config, target) for a, target, config, word in product)
    ]
