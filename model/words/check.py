"""Checks of a program: completeness, and of one read from a file, fitness for every level."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import fields
from itertools import chain
from typing import Any, get_args, get_type_hints

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import InPort, Kind, Op, Port, Program, Scale, Term, Value

__all__ = ["check_complete", "check_program"]

#: Names occur in C and Verilog, as identifiers made from them and in comments.
_NAME = re.compile(r"[A-Za-z0-9_.+-]{1,100}")
_TABLE_BLOCK = 512
#: Limit of numbers, far more than any core holds.
_LIMIT = 100_000


def check_program(program: Program) -> None:
    """Check a program from a file: types, names, sizes, references, and `check_complete`.

    Raises
    ------
    ValueError
        The program is malformed; the message names the first fault.
    """
    for fault in chain(_type_faults(program), _file_faults(program)):
        raise ValueError(fault)
    check_complete(program)


def check_complete(program: Program) -> None:
    """Raise ValueError unless every operation is complete and reads only defined values."""
    for fault in _completeness_faults(program):
        raise ValueError(fault)


def _completeness_faults(p: Program) -> Iterator[str]:
    defined = [value.kind is not Kind.OP for value in p.values]
    for number, op in enumerate(p.ops):
        where = f"operation {number} ({p.values[op.dest].name})"
        for operand in op.operands():
            if not defined[operand]:
                yield f"{where} must read values defined before it, not value {operand}"
        if defined[op.dest]:
            yield f"{where} must be the only writer of a value of kind op, not of value {op.dest}"
        yield from _operation_faults(p, where, op)
        defined[op.dest] = True
    for value in (*p.outputs, *(source for _, source in p.states)):
        if not defined[value]:
            yield f"value {value} ({p.values[value].name}) must be computed"
    for kind, listed in ((Kind.INPUT, p.inputs), (Kind.STATE, [s for s, _ in p.states])):
        if sorted(listed) != p.of_kind(kind):
            yield f"{kind}s must list every value of kind {kind} once, not {sorted(listed)}"
    if len(p.outputs) != len(p.output_names):
        yield f"output_names must be {len(p.outputs)} names, not {len(p.output_names)}"
    low, high = p.arithmetic.min_int, p.arithmetic.max_int
    for word in (*(value.initial for value in p.values), *p.table_memory):
        if not low <= word <= high:
            yield f"words must be {low} to {high}, not {word!r}"


def _operation_faults(p: Program, where: str, op: Op) -> Iterator[str]:
    blocks, largest = len(p.table_memory) // _TABLE_BLOCK, p.arithmetic.shift_max
    if op.table is not None and not 0 <= op.table < blocks:
        yield f"{where} must name a table below {blocks}, not {op.table!r}"
    for term in op.terms:
        if not 0 <= term.shift <= largest:
            yield f"{where}: shift must be 0 to {largest}, not {term.shift!r}"
        if term.conditional and op.flag is None:
            yield f"{where} must name a flag, for a term asks for it"
        if term.scale is not Scale.NONE and op.norm is None:
            yield f"{where} must name a norm, for a term asks for it"
        if (term.b is None) == (term.coefficient is None):
            yield f"{where}: a term must have either b or a coefficient"
        if term.coefficient is not None:
            if op.index is None or op.table is None:
                yield f"{where} must name index and table, for a term asks for them"
            if not 0 <= term.coefficient <= 3:
                yield f"{where}: coefficient must be 0 to 3, not {term.coefficient!r}"
            if term.fraction_b:
                yield f"{where}: fraction_b must be unset where b is a coefficient"


def _type_faults(p: Program) -> Iterator[str]:
    """Yield faults of fields with a type other than the classes declare."""
    parts: tuple[tuple[str, Iterable[Any]], ...] = (
        ("arithmetic", [p.arithmetic]),
        ("value", p.values),
        ("operation", p.ops),
        ("term", chain.from_iterable(op.terms for op in p.ops)),
        ("port", (*p.ports, *p.in_ports)),
    )
    for part, items in parts:
        for item in items:
            kinds = _ALLOWED[type(item)]
            for field in fields(item):
                value, allowed = getattr(item, field.name), kinds[field.name]
                if type(value) not in allowed and not (type(value) is int and float in allowed):
                    yield f"{part} with {field.name} {str(value)[:40]!r}"
    numbers: tuple[Any, ...] = (*p.inputs, *p.outputs, *p.table_memory, *chain(*p.states))
    if any(type(number) is not int for number in numbers):
        yield "a reference that is not a number"
    if not all(isinstance(name, str) for name in (p.name, *p.output_names)):
        yield "a name that is not a text"


def _kinds(type_: type) -> dict[str, tuple[type, ...]]:
    out = {}
    for name, hint in get_type_hints(type_).items():
        origin = getattr(hint, "__origin__", None)
        out[name] = (tuple,) if origin is tuple else get_args(hint) or (hint,)
    return out


_ALLOWED: dict[type, dict[str, tuple[type, ...]]] = {
    type_: _kinds(type_) for type_ in (Arithmetic, Value, Op, Term, Port, InPort)
}


def _file_faults(p: Program) -> Iterator[str]:
    if p.arithmetic != Arithmetic(p.arithmetic.word):
        yield "an arithmetic without a core"
    if max(len(p.values), len(p.ops), len(p.table_memory)) > _LIMIT:
        yield "a program too large for any core"
    for name in (p.name, *p.output_names, *(v.name for v in p.values)):
        if not _NAME.fullmatch(name):
            yield f"the name {name[:40]!r}"
    if len(set(p.output_names)) != len(p.outputs):
        yield "outputs without a name of their own"
    if len(p.ports) not in (0, len(p.outputs)) or len(p.in_ports) not in (0, len(p.inputs)):
        yield "ports that are not those of its inputs and outputs"
    if len(p.table_memory) % _TABLE_BLOCK:
        yield "a table that does not exist"
    if any(not -128 <= v.frac <= 128 for v in p.values):
        yield "a value without a binary point near its word"
    if not p.inputs or not p.outputs:
        yield "no inputs or no outputs"
    read = chain.from_iterable((op.dest, *op.operands()) for op in p.ops)
    if any(not 0 <= n < len(p.values) for n in (*p.inputs, *p.outputs, *chain(*p.states), *read)):
        yield "a reference to a value that does not exist"
    if len(p.ops) != len(p.of_kind(Kind.OP)):
        yield "a value that no operation computes"
    if not all(op.terms for op in p.ops):
        yield "an operation without terms"
