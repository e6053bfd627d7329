"""The core of a complete system: all filters and the programs before them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.system.plan import FRONT_NAMES, Plan, plan_of
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, with_params
from boresight.model.front import FRONT
from boresight.model.resolve import Named, estimator_of

__all__ = ["FILTERS", "core_plan", "system_core", "system_estimators"]

#: Filters of the complete system, in the order of their numbers.
FILTERS = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")


def system_estimators(filters: Sequence[Named] = FILTERS) -> list[Estimator]:
    """Filters, then the programs before them: in the order of their numbers in the core.

    Raises
    ------
    InputError
        Unknown name.
    """
    return [*map(estimator_of, filters), *(FRONT[name]() for name in FRONT_NAMES)]


def system_core(
    filters: Sequence[Named] = FILTERS,
    *,
    config: str = "small",
    word: int = 32,
    clock_hz: float = 100e6,
    params: Mapping[str, Mapping[str, float]] | None = None,
    restarts: int | None = None,
) -> Core:
    """Compile the core of a system. Filter k is program k; the front programs follow.

    Parameters
    ----------
    filters : sequence of str, class or Estimator
        Filters of the same inputs and outputs.
    config : str
        "small" or "fast".
    clock_hz : float
        Clock of the system, Hz: time stamps count its cycles (``tick_s``).
    params : mapping, optional
        By program's name, the parameter values other than the defaults.
    restarts : int, optional
        Effort of the scheduler.

    Raises
    ------
    InputError
        Unknown name of a filter, of a program with parameters, of a parameter or configuration; a
        word below 26 bits.
    ScheduleError
        The programs do not fit the machine.
    """
    if not 26 <= word <= 32:
        raise InputError.at(
            "word",
            wanted="26 to 32 bits for a complete system",
            found=str(word),
            fix="choose a width inside the range",
        )
    estimators = system_estimators(filters)
    for name in params or {}:
        if name not in {e.name for e in estimators}:
            raise InputError.at(
                f"parameters of {name}",
                fix="leave them out, or add the filter",
                wanted=f"one of {', '.join(e.name for e in estimators)}",
                found=repr(name),
            )
    values = {"calibrate_inertial": {"tick_s": 1.0 / clock_hz}}
    for name, given in (params or {}).items():
        values[name] = {**values.get(name, {}), **given}
    programs = [with_params(e.compile(word=word), e, values.get(e.name)) for e in estimators]
    return build_shared_core(programs, config, restarts=restarts)


def core_plan(core: Core) -> Plan:
    """What the conductor is told about a core; see `plan_of` for the errors."""
    return plan_of([part.program for part in core.parts], [part.schedule for part in core.parts])
