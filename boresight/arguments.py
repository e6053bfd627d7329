"""Checks of arguments that several verbs take, made before any work and any folder."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from typing import Any

from boresight.gateware.machine import machine_named
from boresight.gateware.synthesis.nextpnr import find_router
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError, require_choice
from boresight.model.estimator import Estimator
from boresight.model.words.fixed import check_word

__all__ = [
    "JOBS_MOST",
    "SEED_MOST",
    "check_machine",
    "check_number",
    "check_optional",
    "check_routable",
    "check_target",
    "check_urgent",
    "check_word",
]

#: Largest number of threads or processes.
JOBS_MOST = 1024
#: Largest seed of a draw.
SEED_MOST = 2**31


def check_number(where: str, value: Any, low: int, high: int | None = None) -> None:
    """Raise InputError unless ``value`` is a whole number from ``low`` to ``high``, if given."""
    try:
        number = operator.index(value)
    except TypeError:
        number = low - 1
    if number < low or (high is not None and number > high):
        raise InputError.at(
            where,
            wanted=f"{low:,} or more" if high is None else f"{low:,} to {high:,}",
            found=str(value),
            fix="choose another",
        )


def check_optional(where: str, value: Any, low: int, high: int | None = None) -> None:
    """`check_number`, unless ``value`` is None."""
    if value is not None:
        check_number(where, value, low, high)


def check_target(name: str, choices: Iterable[str]) -> None:
    """Raise InputError unless ``name`` is one of the targets ``choices``."""
    require_choice("target", name, choices, "choose one; docs/targets.md has them all")


def check_urgent(urgent: Any, estimators: Iterable[Estimator]) -> None:
    """Raise InputError unless it is None, or a number of outputs that each estimator has."""
    check_optional("urgent", urgent, 1, min(len(e.outputs) for e in estimators))


def check_routable(targets: Sequence[str], alternative: str) -> None:
    """Raise InputError unless an open tool routes one of ``targets``, ToolMissing without it."""
    routers = [TARGETS[name].family.router for name in targets if name in TARGETS]
    if not any(routers):
        routed = {other.device.name: None for other in TARGETS.values() if other.family.router}
        raise InputError.at(
            "route",
            wanted="a target that an open tool routes",
            found=f"--target {','.join(targets)}",
            fix=f"choose {', '.join(routed)}, or {alternative} for area alone",
        )
    for router in routers:
        if router is not None:
            find_router(router)


def check_machine(config: str, word: int) -> None:
    """Raise InputError unless ``config`` is a configuration and ``word`` a word width."""
    machine_named(config)
    check_word(word)
