"""Faults of hardware as Amaranth has it: dropped assignments, swapped choices, widths, resets."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from tests.mutants.edits import Mutant, Source, scopes
from tests.mutants.walk import Change, changed_number, changed_operator, expressions, mutants_of

#: Calls by which a function is seen to describe hardware.
_HARDWARE = {"Signal", "Mux", "In", "Out", "Cat", "Module"}
#: Names of widths, in ``Signal(self.word)`` and the like.
_WIDTH = re.compile(r"(^|[._])(word|width|bits|size)\w*$")


def hardware_mutants(file: str, text: str) -> list[Mutant]:
    """All mutants of a file's hardware, in the order of the text."""
    source = Source(file, text)
    results = [
        mutant
        for scope, function in scopes(source.tree)
        if _describes_hardware(function)
        for mutant in mutants_of(source, scope, function, _changes)
    ]
    return sorted(results, key=lambda mutant: (mutant.start, mutant.end, mutant.new))


def _describes_hardware(function: ast.FunctionDef) -> bool:
    return any(
        (isinstance(node, ast.Call) and _name(node.func) in _HARDWARE) or _domain(node) is not None
        for node in ast.walk(function)
    )


def _name(node: ast.expr) -> str:
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _domain(node: ast.AST) -> str | None:
    """``sync`` of ``m.d.sync``."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Attribute):
        return node.attr if node.value.attr == "d" else None
    return None


def _changes(source: Source, statement: ast.stmt) -> Iterator[Change]:
    yield from _dropped(source, statement)
    if isinstance(statement, ast.With):
        yield from _conditions(source, statement)
    for node in expressions(statement):
        yield from _expression(source, node)


def _dropped(source: Source, statement: ast.stmt) -> Iterator[Change]:
    """An assignment, or a next state, is left out."""
    if isinstance(statement, ast.AugAssign) and _domain(statement.target) is not None:
        value = statement.value
        if isinstance(value, ast.List) and len(value.elts) > 1:
            for each in value.elts:
                yield each, "*()", "dropped assignment"
        else:
            yield statement, "pass", "dropped assignment"
    elif isinstance(statement, ast.Assign) and source.of(statement.targets[0]) == "m.next":
        yield statement, "pass", "dropped next state"


def _conditions(source: Source, statement: ast.With) -> Iterator[Change]:
    for item in statement.items:
        call = item.context_expr
        if isinstance(call, ast.Call) and _name(call.func) in ("If", "Elif"):
            yield call.args[0], f"({source.of(call.args[0])}) == 0", "inverted condition"


def _expression(source: Source, node: ast.expr) -> Iterator[Change]:
    yield from changed_operator(source, node)
    if isinstance(node, ast.Call):
        yield from _call(source, node)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Invert):
        yield node, source.of(node)[1:], "inversion left out"
    elif isinstance(node, ast.Constant) and (new := changed_number(node)) is not None:
        yield node, new, "number"


def _call(source: Source, node: ast.Call) -> Iterator[Change]:
    name = _name(node.func)
    if name == "Mux":
        condition, yes, no = (source.of(arg) for arg in node.args)
        yield node, f"Mux({condition}, {no}, {yes})", "swapped choice"
    if name in ("Signal", "In", "Out") and node.args:
        yield from _narrower(source, node.args[0])
    for keyword in node.keywords:
        if keyword.arg == "init" and not isinstance(keyword.value, ast.List | ast.Dict):
            zero = isinstance(keyword.value, ast.Constant) and not keyword.value.value
            yield keyword.value, "1" if zero else "0", "reset value"


def _narrower(source: Source, shape: ast.expr) -> Iterator[Change]:
    """One bit less, or one value less."""
    if isinstance(shape, ast.Constant) and type(shape.value) is int and shape.value > 1:
        yield shape, str(shape.value - 1), "width"
    elif isinstance(shape, ast.Call) and _name(shape.func) == "range" and len(shape.args) == 1:
        yield shape.args[0], f"({source.of(shape.args[0])}) - 1", "width"
    elif isinstance(shape, ast.Name | ast.Attribute) and _WIDTH.search(source.of(shape)):
        yield shape, f"{source.of(shape)} - 1", "width"
