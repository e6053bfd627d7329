"""What must hold for a program before C can be written for it."""

from __future__ import annotations

from boresight.model.words.program import Kind, Negate, Op, Program, Scale, When

__all__ = ["check"]


def _check_op(program: Program, where: str, op: Op, known: list[bool]) -> None:
    arith = program.arithmetic
    for operand in op.operands():
        if not known[operand]:
            raise ValueError(f"{where} must read what is known before it, not value {operand}")
    if program.values[op.dest].kind is not Kind.OP or known[op.dest]:
        raise ValueError(
            f"{where} must be the only writer of a value of kind op, not of value {op.dest}"
        )
    blocks = len(program.table_memory) // 512
    if op.table is not None and not 0 <= op.table < blocks:
        raise ValueError(f"{where} must name a table below {blocks}, not {op.table!r}")
    for term in op.terms:
        if not 0 <= term.shift <= arith.shift_max:
            raise ValueError(f"{where}: shift must be 0 to {arith.shift_max}, not {term.shift!r}")
        conditional = term.negate in (Negate.IF, Negate.UNLESS) or term.when is not When.ALWAYS
        if conditional and op.flag is None:
            raise ValueError(f"{where} must name a flag, for a term asks for it")
        if term.scale is not Scale.NONE and op.norm is None:
            raise ValueError(f"{where} must name a norm, for a term asks for it")
        if (term.b is None) == (term.coefficient is None):
            raise ValueError(f"{where}: a term must have either b or a coefficient")
        if term.coefficient is not None:
            if op.index is None or op.table is None:
                raise ValueError(f"{where} must name index and table, for a term asks for them")
            if not 0 <= term.coefficient <= 3:
                raise ValueError(f"{where}: coefficient must be 0 to 3, not {term.coefficient!r}")
            if term.fraction_b:
                raise ValueError(f"{where}: fraction_b must be unset where b is a coefficient")


def check(program: Program) -> None:
    """Raise ValueError unless every operation is complete and reads only what is known."""
    known = [value.kind is not Kind.OP for value in program.values]
    for number, op in enumerate(program.ops):
        where = f"operation {number} ({program.values[op.dest].name})"
        _check_op(program, where, op, known)
        known[op.dest] = True
    for value in (*program.outputs, *(source for _, source in program.states)):
        if not known[value]:
            raise ValueError(f"value {value} ({program.values[value].name}) must be computed")
    listed = sorted(program.inputs)
    if listed != program.of_kind(Kind.INPUT):
        raise ValueError(f"inputs must list every value of kind input once, not {listed}")
    listed = sorted(state for state, _ in program.states)
    if listed != program.of_kind(Kind.STATE):
        raise ValueError(f"states must list every value of kind state once, not {listed}")
    if len(program.outputs) != len(program.output_names):
        raise ValueError(
            f"output_names must be {len(program.outputs)} names, not {len(program.output_names)}"
        )
    low, high = program.arithmetic.min_int, program.arithmetic.max_int
    for word in (*(value.initial for value in program.values), *program.table_memory):
        if not low <= word <= high:
            raise ValueError(f"words must be {low} to {high}, not {word!r}")
