"""Is a program that came from a file one that every level can run?"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, get_args, get_type_hints

from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Scale, Term, Value

__all__ = ["check_program"]

#: Names end up in C and Verilog, made safe, and in their comments.
_NAME = re.compile(r"[A-Za-z0-9_.+-]{1,100}")
_TABLE_BLOCK = 512
#: Far more than any core holds.
_MOST = 100_000


def check_program(program: Program) -> None:
    """Check types, names, references, ranges and order of a program.

    Raises
    ------
    ValueError
        The message says what is wrong, in some words.
    """
    for fault in _faults(program):
        raise ValueError(fault)


def _faults(p: Program) -> Iterator[str]:
    yield from _of_types(p)
    if p.arithmetic != Arithmetic(p.arithmetic.word):
        yield "an arithmetic that no core has"
    if max(len(p.values), len(p.ops), len(p.table_memory)) > _MOST:
        yield "a program that no core holds"
    for name in (p.name, *p.output_names, *(v.name for v in p.values)):
        if not _NAME.fullmatch(name):
            yield f"the name {name[:40]!r}"
    if len(set(p.output_names)) != len(p.outputs) or len(p.output_names) != len(p.outputs):
        yield "outputs without a name of their own"
    words = range(p.arithmetic.min_int, p.arithmetic.max_int + 1)
    if len(p.table_memory) % _TABLE_BLOCK or any(w not in words for w in p.table_memory):
        yield "a table that is none"
    for v in p.values:
        if v.initial not in words or not -128 <= v.frac <= 128:
            yield f"value {v.name} outside its word"
    yield from _references(p)


def _of_types(p: Program) -> Iterator[str]:
    """Fields of another type than the classes say: JSON holds anything."""
    for what, of in (("arithmetic", [p.arithmetic]), ("value", p.values), ("operation", p.ops)):
        for item in of:
            yield from _fields(what, item)
    for op in p.ops:
        for term in op.terms:
            yield from _fields("term", term)
    numbers: tuple[Any, ...] = (*p.inputs, *p.outputs, *p.table_memory)
    for number in (*numbers, *(n for pair in p.states for n in pair)):
        if type(number) is not int:
            yield "a reference that is no number"
    for name in (p.name, *p.output_names):
        if not isinstance(name, str):
            yield "a name that is no text"


def _fields(what: str, item: Arithmetic | Value | Op | Term) -> Iterator[str]:
    kinds = _ALLOWED[type(item)]
    for field in fields(item):
        value = getattr(item, field.name)
        allowed = kinds[field.name]
        if type(value) not in allowed and not (type(value) is int and float in allowed):
            yield f"{what} with {field.name} {str(value)[:40]!r}"


def _kinds(of: type) -> dict[str, tuple[type, ...]]:
    hints = get_type_hints(of)
    out = {}
    for name, hint in hints.items():
        plain = getattr(hint, "__origin__", None)
        out[name] = (tuple,) if plain is tuple else get_args(hint) or (hint,)
    return out


_ALLOWED: dict[type, dict[str, tuple[type, ...]]] = {
    of: _kinds(of) for of in (Arithmetic, Value, Op, Term)
}


def _references(p: Program) -> Iterator[str]:
    count = len(p.values)
    for number in (*p.inputs, *p.outputs, *(n for pair in p.states for n in pair)):
        if not 0 <= number < count:
            yield "a reference to no value"
            return
    for kind, listed in ((Kind.INPUT, p.inputs), (Kind.STATE, [s for s, _ in p.states])):
        if sorted(listed) != p.of_kind(kind):
            yield f"{kind.value}s that are not listed once each"
    if not p.inputs or not p.outputs:
        yield "no inputs or no outputs"
    known = {n for n, v in enumerate(p.values) if v.kind is not Kind.OP}
    for op in p.ops:
        if not set(op.operands()) <= known:
            yield "an operation that reads what is not there yet"
        if not 0 <= op.dest < count or op.dest in known:
            yield "an operation whose result has another place"
        yield from _operation(p, op)
        known.add(op.dest)
    if len(known) != count:
        yield "a value that no operation gives"


def _operation(p: Program, op: Op) -> Iterator[str]:
    if not op.terms:
        yield "an operation without terms"
    blocks = len(p.table_memory) // _TABLE_BLOCK
    if op.table is not None and op.index is None:
        yield "a table without index"
    if op.table is not None and not 0 <= op.table < blocks:
        yield "a table that is not there"
    for term in op.terms:
        if not 0 <= term.shift <= p.arithmetic.shift_max:
            yield f"a shift of {term.shift}"
        if (term.b is None) == (term.coefficient is None):
            yield "a term of one factor, or of three"
        if term.coefficient is not None and (op.table is None or not 0 <= term.coefficient <= 3):
            yield "a coefficient without table"
        if term.scale is not Scale.NONE and op.norm is None:
            yield "a scale without a value to take it from"
        if op.flag is None and (term.negate.value in ("if", "unless") or term.when != "always"):
            yield "a condition without a flag"
