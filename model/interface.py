"""Checks of an estimator's declarations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import Protocol

from boresight.model.declarations import Input, Output, Param, State, check_declared
from boresight.model.errors import InputError, require
from boresight.model.places import placed


class Interface(Protocol):
    """Declarations of an estimator."""

    name: str
    inputs: tuple[Input, ...]
    params: tuple[Param, ...]
    states: tuple[State, ...]
    outputs: tuple[Output, ...]
    urgent: int
    rates_hz: Mapping[str, float]


def check_interface(estimator: Interface, line: str) -> None:
    """Refuse declarations that contradict each other.

    Parameters
    ----------
    estimator : Interface
    line : str
        Source location of its class, "file.py, line 12", or empty.

    Raises
    ------
    InputError
        A declaration that is not a tuple of its kind, a name that is illegal or occurs twice, a
        parameter with the name of an input or state, no output, ``urgent`` above the number of
        outputs, ``valid_of`` without an input that has samples, ``rates_hz`` that are no rates of
        the log and of inputs.
    """
    name = f"estimator {estimator.name}"
    where = placed(line, name)
    _check_kinds(estimator, where)
    check_declared(where, ("estimator", (estimator,)))
    check_declared(
        name,
        ("input", estimator.inputs),
        ("parameter", estimator.params),
        ("state", estimator.states),
        ("output", estimator.outputs),
    )
    _check_parameters(estimator, name)
    if not estimator.outputs:
        raise InputError.at(where, wanted="an output", found="none", fix="declare outputs")
    if not 0 <= estimator.urgent <= len(estimator.outputs):
        wanted, found = f"urgent of 0 to {len(estimator.outputs)}", str(estimator.urgent)
        fix = "it counts the leading outputs whose latency counts first"
        raise InputError.at(where, wanted=wanted, found=found, fix=fix)
    _check_flags(estimator, name)
    _check_rates(estimator, where)


def _check_flags(estimator: Interface, name: str) -> None:
    """Refuse flags of inputs that are not declared."""
    names = {i.name for i in estimator.inputs if not i.flags}
    for flag in estimator.inputs:
        unknown = [other for other in flag.flags if other not in names]
        if unknown:
            raise InputError.at(
                placed(flag.line, f"{name}, input {flag.name}"),
                wanted="valid_of names of inputs",
                found=unknown[0],
                fix=f"choose {', '.join(sorted(names)) or 'inputs with columns'}",
            )


def _check_rates(estimator: Interface, where: str) -> None:
    """Refuse sample rates without that of the log, of unknown inputs, or not above 0."""
    rates, names = estimator.rates_hz, {"dt", *(i.name for i in estimator.inputs)}
    found = None
    if not isinstance(rates, Mapping):
        found = type(rates).__name__
    elif unknown := [name for name in rates if name not in names]:
        found = repr(unknown[0])
    elif rates and "dt" not in rates:
        found = f"{', '.join(rates)} alone"
    elif wrong := [f"{n}: {rate!r}" for n, rate in rates.items() if not _is_rate(rate)]:
        found = wrong[0]
    if found is not None:
        raise InputError.at(
            f"{where}, rates_hz",
            wanted="samples a second, of the log (dt) and of inputs, by name",
            found=found,
            fix='write for example rates_hz = {"dt": 100.0}',
        )


def _is_rate(value: object) -> bool:
    return isinstance(value, Real) and 0.0 < float(value) < math.inf


def _check_parameters(estimator: Interface, name: str) -> None:
    """Refuse parameters with the name of an input or state."""
    names = {i.name for i in estimator.inputs} | {s.name for s in estimator.states}
    for p in estimator.params:
        where = placed(p.line, f"{name}, parameter {p.name}")
        wanted = "a name that no input or state has"
        require(p.name not in names, where, wanted, p.name, "rename one")


def _check_kinds(estimator: Interface, where: str) -> None:
    """Refuse declarations that are not tuples of their kind."""
    for name, kind in (
        ("inputs", Input),
        ("params", Param),
        ("states", State),
        ("outputs", Output),
    ):
        declared = getattr(estimator, name)
        is_sequence = isinstance(declared, tuple | list)
        invalid = [d for d in (declared if is_sequence else [declared]) if not isinstance(d, kind)]
        if invalid or not is_sequence:
            name_of_type = type(invalid[0] if invalid else declared).__name__
            raise InputError.at(
                f"{where}, {name}",
                wanted=f"a tuple of {kind.__name__}",
                found=name_of_type if is_sequence else f"one {name_of_type}",
                fix=f"write {name} = ({kind.__name__}(...),), also where there is only one",
            )
