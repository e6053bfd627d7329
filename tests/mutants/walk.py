"""Walks a function's statements and expressions; faults that hardware and software share."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

from tests.mutants.edits import Mutant, Source

#: (node that is replaced, its new text, kind).
Change = tuple[ast.AST, str, str]

#: Operators, and what each is mistaken for.
_COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}
_OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "//"),
    ast.FloorDiv: ("//", "*"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
    ast.BitXor: ("^", "|"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
}


def statements(function: ast.FunctionDef) -> Iterator[ast.stmt]:
    """All statements but docstrings, refusals of arguments and assertions, depth first."""

    def inside(body: list[ast.stmt]) -> Iterator[ast.stmt]:
        for statement in body:
            if _is_text(statement) or isinstance(statement, ast.Raise | ast.Assert):
                continue
            if isinstance(statement, ast.If) and _refuses(statement):
                continue
            yield statement
            for name in ("body", "orelse", "finalbody"):
                yield from inside(getattr(statement, name, []))
            for handler in getattr(statement, "handlers", []):
                yield from inside(handler.body)

    yield from inside(function.body)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _refuses(statement: ast.If) -> bool:
    return not statement.orelse and all(isinstance(s, ast.Raise) for s in statement.body)


def expressions(statement: ast.stmt) -> Iterator[ast.expr]:
    """Expressions of a statement itself, without its body, its annotations and its texts."""

    def inside(node: ast.AST) -> Iterator[ast.expr]:
        for name, field in ast.iter_fields(node):
            if name in ("body", "orelse", "finalbody", "handlers") and isinstance(field, list):
                continue
            if name in ("annotation", "returns", "args") and isinstance(
                node, ast.AnnAssign | ast.FunctionDef
            ):
                continue
            for child in field if isinstance(field, list) else [field]:
                if isinstance(child, ast.JoinedStr):
                    continue
                if isinstance(child, ast.expr):
                    yield child
                if isinstance(child, ast.AST):
                    yield from inside(child)

    yield from inside(statement)


def changed_number(node: ast.Constant) -> str | None:
    """A whole number, one off; None for anything else."""
    if type(node.value) is not int:
        return None
    return str(node.value + 1)


def changed_operator(source: Source, node: ast.expr) -> Iterator[Change]:
    """A comparison or an arithmetic operator that is another one."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        old, new = _COMPARISONS[type(node.ops[0])]
        yield node, source.between(node, node.left, node.comparators[0], old, new), "comparison"
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        old, new = _OPERATORS[type(node.op)]
        yield node, source.between(node, node.left, node.right, old, new), "operator"


def mutants_of(
    source: Source,
    scope: str,
    function: ast.FunctionDef,
    changes: Callable[[Source, ast.stmt], Iterator[Change]],
) -> Iterator[Mutant]:
    """All mutants of a function."""
    seen: Counter[str] = Counter()
    for statement in statements(function):
        for node, new, kind in changes(source, statement):
            result = source.mutant(node, new, kind, scope, statement)
            if result is not None:
                seen[result.key] += 1
                yield replace(result, nth=seen[result.key])
