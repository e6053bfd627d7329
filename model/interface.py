"""Declarations of an estimator that contradict each other, or are none."""

from __future__ import annotations

from typing import Protocol

from boresight.model.declarations import Input, Output, Param, State, check_declared
from boresight.model.errors import InputError
from boresight.model.places import placed

__all__ = ["Interface", "check_interface"]


class Interface(Protocol):
    """What an estimator declares."""

    name: str
    inputs: tuple[Input, ...]
    params: tuple[Param, ...]
    states: tuple[State, ...]
    outputs: tuple[Output, ...]
    urgent: int


def check_interface(given: Interface, line: str) -> None:
    """Refuse declarations that contradict each other.

    Parameters
    ----------
    given : Interface
    line : str
        Where it begins, "file.py, line 12", or nothing.

    Raises
    ------
    InputError
        A declaration that is no tuple of its kind, a name twice or illegal, a parameter called as
        an input or state, no output, ``urgent`` beyond the outputs, ``valid_of`` of no input that
        has samples.
    """
    name = f"estimator {given.name}"
    where = placed(line, name)
    _check_kinds(given, where)
    check_declared(where, ("estimator", (given,)))
    check_declared(
        name,
        ("input", given.inputs),
        ("parameter", given.params),
        ("state", given.states),
        ("output", given.outputs),
    )
    _check_parameters(given, name)
    if not given.outputs:
        raise InputError.at(where, wanted="an output", found="none", fix="declare outputs")
    if not 0 <= given.urgent <= len(given.outputs):
        raise InputError.at(
            where,
            wanted=f"urgent of 0 to {len(given.outputs)}",
            found=str(given.urgent),
            fix="it counts the leading outputs whose latency counts first",
        )
    _check_flags(given, name)


def _check_flags(given: Interface, name: str) -> None:
    """Refuse flags of inputs that there are not."""
    names = {i.name for i in given.inputs if not i.flags}
    for flag in given.inputs:
        unknown = [other for other in flag.flags if other not in names]
        if unknown:
            raise InputError.at(
                placed(flag.line, f"{name}, input {flag.name}"),
                wanted="valid_of names of inputs",
                found=unknown[0],
                fix=f"choose of {', '.join(sorted(names)) or 'inputs with columns'}",
            )


def _check_parameters(given: Interface, name: str) -> None:
    """Refuse parameters that are called as an input or state."""
    taken = {i.name for i in given.inputs} | {s.name for s in given.states}
    for p in given.params:
        if p.name in taken:
            raise InputError.at(
                placed(p.line, f"{name}, parameter {p.name}"),
                wanted="a name that no input or state has",
                found=repr(p.name),
                fix="rename one",
            )


def _check_kinds(given: Interface, where: str) -> None:
    """Refuse declarations that are no tuples of their kind."""
    for name, kind in (
        ("inputs", Input),
        ("params", Param),
        ("states", State),
        ("outputs", Output),
    ):
        declared = getattr(given, name)
        several = isinstance(declared, tuple | list)
        wrong = [d for d in (declared if several else [declared]) if not isinstance(d, kind)]
        if wrong or not several:
            found = type(wrong[0] if wrong else declared).__name__
            raise InputError.at(
                f"{where}, {name}",
                wanted=f"a tuple of {kind.__name__}",
                found=found if several else f"one {found}",
                fix=f"write {name} = ({kind.__name__}(...),), also where there is only one",
            )
