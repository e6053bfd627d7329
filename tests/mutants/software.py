"""Faults of plain Python: comparisons, numbers off by one, what is dropped or swapped."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.mutants.edits import Mutant, Source, scopes
from tests.mutants.walk import Change, changed_number, changed_operator, expressions, mutants_of

#: Calls whose arguments have an order that a test can see, when there are two or more.
_UNORDERED = {"max", "min", "isinstance", "zip", "Counter", "maximum", "minimum"}
_OPPOSITE = {"max": "min", "min": "max", "any": "all", "all": "any"}


def software_mutants(file: str, text: str) -> list[Mutant]:
    """All mutants of a file's functions, in the order of the text."""
    source = Source(file, text)
    results = [
        mutant
        for scope, function in scopes(source.tree)
        for mutant in mutants_of(source, scope, function, _changes)
    ]
    return sorted(results, key=lambda mutant: (mutant.start, mutant.end, mutant.new))


def _changes(source: Source, statement: ast.stmt) -> Iterator[Change]:
    dropped = isinstance(statement, ast.Expr | ast.AugAssign | ast.Continue | ast.Break)
    if isinstance(statement, ast.Assign):  # a new name is missed at once; a part of something?
        dropped = not isinstance(statement.targets[0], ast.Name)
    if dropped:
        yield statement, "pass", "dropped statement"
    if isinstance(statement, ast.If | ast.While):
        yield statement.test, f"not ({source.of(statement.test)})", "inverted condition"
    for node in expressions(statement):
        yield from _expression(source, node)


def _expression(source: Source, node: ast.expr) -> Iterator[Change]:
    yield from changed_operator(source, node)
    if isinstance(node, ast.BoolOp):
        word = " or " if isinstance(node.op, ast.And) else " and "
        yield node, f"({word.join(f'({source.of(v)})' for v in node.values)})", "and, or"
        for k in range(len(node.values)):
            rest = [f"({source.of(v)})" for n, v in enumerate(node.values) if n != k]
            joined = f" {'and' if isinstance(node.op, ast.And) else 'or'} ".join(rest)
            yield node, f"({joined})", "condition left out"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node, f"({source.of(node.operand)})", "inversion left out"
    elif isinstance(node, ast.IfExp):
        test, yes, no = (f"({source.of(part)})" for part in (node.test, node.body, node.orelse))
        yield node, f"({no} if {test} else {yes})", "swapped choice"
    elif isinstance(node, ast.Call):
        yield from _call(source, node)
    elif isinstance(node, ast.Constant):
        if isinstance(node.value, bool):
            yield node, str(not node.value), "number"
        elif (new := changed_number(node)) is not None:
            yield node, new, "number"


def _call(source: Source, node: ast.Call) -> Iterator[Change]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if isinstance(node.func, ast.Name) and name in _OPPOSITE:
        yield node.func, _OPPOSITE[name], "opposite"
    if len(node.args) >= 2 and name not in _UNORDERED:
        first, second = node.args[:2]
        if not isinstance(first, ast.Starred) and not isinstance(second, ast.Starred):
            whole = source.of(node)
            begin = source.span(node)[0]
            cuts = [at - begin for arg in (first, second) for at in source.span(arg)]
            data = whole.encode()
            new = (
                data[: cuts[0]]
                + source.of(second).encode()
                + data[cuts[1] : cuts[2]]
                + source.of(first).encode()
                + data[cuts[3] :]
            )
            yield node, new.decode(), "swapped arguments"
