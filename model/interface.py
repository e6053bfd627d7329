"""Checks of an estimator's declarations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from keyword import iskeyword
from numbers import Real
from typing import Any

from boresight.model.declarations import Input, Output, Param, State
from boresight.model.errors import InputError, require
from boresight.model.places import placed

_KINDS = (
    ("input", "inputs", Input),
    ("parameter", "params", Param),
    ("state", "states", State),
    ("output", "outputs", Output),
)


def check_interface(estimator: Any, line: str) -> None:
    """Refuse declarations that contradict each other.

    Parameters
    ----------
    estimator : Estimator
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
    _check_name(where, "estimator", estimator.name)
    for noun, group, kind in _KINDS:
        declared = getattr(estimator, group)
        several = isinstance(declared, tuple | list)
        for d in declared if several else [declared]:
            if not several or not isinstance(d, kind):
                raise InputError.at(
                    f"{where}, {group}",
                    wanted=f"a tuple of {kind.__name__}",
                    found=f"{'' if several else 'one '}{type(d).__name__}",
                    fix=f"write {group} = ({kind.__name__}(...),), also where there is only one",
                )
        names = set[str]()
        for d in declared:
            place = placed(d.line, name)
            _check_name(place, noun, d.name)
            require(d.name not in names, place, f"each {noun} once", d.name, "rename one")
            names.add(d.name)
    inputs, outputs, rates = estimator.inputs, estimator.outputs, estimator.rates_hz
    for p in estimator.params:
        place = placed(p.line, f"{name}, parameter {p.name}")
        taken = p.name in [d.name for d in (*inputs, *estimator.states)]
        require(not taken, place, "a name that no input or state has", p.name, "rename one")
    require(bool(outputs), where, "an output", outputs, "declare outputs")
    fix = "it counts the leading outputs whose latency counts first"
    urgent = estimator.urgent is None or 0 <= estimator.urgent <= len(outputs)
    require(urgent, where, f"urgent of 0 to {len(outputs)}", estimator.urgent, fix)
    sampled = [i.name for i in inputs if not i.flags]
    for i in inputs:
        place = placed(i.line, f"{name}, input {i.name}")
        fix = f"choose {', '.join(sampled) or 'inputs with columns'}"
        for other in i.flags:
            require(other in sampled, place, "valid_of names of inputs", other, fix)
    known = isinstance(rates, Mapping) and {*rates} <= {"dt", *(i.name for i in inputs)}
    good = known and all(isinstance(r, Real) and 0.0 < float(r) < math.inf for r in rates.values())
    require(
        good and (not rates or "dt" in rates),
        f"{where}, rates_hz",
        "samples a second, of the log (dt) and of inputs, by name",
        rates,
        'write for example rates_hz = {"dt": 100.0}',
    )


def _check_name(where: str, kind: str, name: Any) -> None:
    valid = isinstance(name, str) and name.isidentifier() and not iskeyword(name)
    wanted = f"{kind} names of letters, digits and _, no words of Python"
    require(valid, where, wanted, name, "rename it")
