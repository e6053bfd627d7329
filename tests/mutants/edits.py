"""An edit of a source text, found in its syntax tree and made in the text itself."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Attributes
    ----------
    file : str
        Path from the root of the tree.
    scope : str
        Class and function.
    statement : str
        The statement without its body (of a list of assignments, or of a table, the one entry),
        for the reader.
    old, new : str
        The part that is replaced, and by what; ``old`` in the same one spelling.
    kind : str
        What sort of fault.
    start, end : int
        Place in the file, in bytes.
    line : int
        For the reader.
    nth : int
        Which of the edits of this kind in the function that replace the same by the same, from 1.
    """

    file: str
    scope: str
    statement: str
    old: str
    new: str
    kind: str
    start: int
    end: int
    line: int
    nth: int = 1

    @property
    def key(self) -> str:
        """Identity in lists and between runs: the function and the kind of edit."""
        which = f" ({self.nth})" if self.nth > 1 else ""
        return f"{self.file} | {self.scope} | {self.kind} | {self.old} -> {self.new}{which}"

    def apply(self, text: str) -> str:
        """``text`` of the file with the fault."""
        data = text.encode()
        return (data[: self.start] + self.new.encode() + data[self.end :]).decode()


class Source:
    """A file, its tree, and the places of its nodes."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.text = file, text
        self.tree = ast.parse(text)
        self._data = text.encode()
        self._lines = [0]
        for line in text.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line.encode()))

    def span(self, node: ast.AST) -> tuple[int, int]:
        """First byte of a node and the first one behind it."""
        first = self._lines[node.lineno - 1] + node.col_offset
        return first, self._lines[node.end_lineno - 1] + node.end_col_offset

    def of(self, node: ast.AST) -> str:
        """The text of a node as it stands."""
        first, last = self.span(node)
        return self._data[first:last].decode()

    def between(self, node: ast.AST, left: ast.AST, right: ast.AST, old: str, new: str) -> str:
        """The text of ``node`` with the operator between two parts of it another."""
        (first, last), cut, go_on = self.span(node), self.span(left)[1], self.span(right)[0]
        gap = self._data[cut:go_on].decode().replace(old, new, 1)
        return self._data[first:cut].decode() + gap + self._data[go_on:last].decode()

    def mutant(
        self, node: ast.AST, new: str, kind: str, scope: str, statement: ast.stmt
    ) -> Mutant | None:
        """``node`` replaced, unless that is only another spelling."""
        start, end = self.span(node)
        result = Mutant(
            self.file,
            scope,
            self._context(node, statement),
            ast.unparse(node),
            " ".join(new.split()) if "#" not in new else new,
            kind,
            start,
            end,
            node.lineno,
        )
        return None if _same(node, new) else result

    def _context(self, node: ast.AST, statement: ast.stmt) -> str:
        """The statement in one line, without its body; of a list of assignments the one."""
        value = getattr(statement, "value", None)
        if isinstance(statement, ast.AugAssign) and isinstance(value, ast.List):
            start, end = self.span(node)
            for each in value.elts:
                first, last = self.span(each)
                if first <= start and end <= last:
                    return f"{ast.unparse(statement.target)} += {ast.unparse(each)}"
        for table in (n for n in ast.walk(statement) if isinstance(n, ast.Dict)):
            for key, each in zip(table.keys, table.values, strict=True):
                first, last = self.span(each)
                if first <= self.span(node)[0] and self.span(node)[1] <= last:
                    return f"{ast.unparse(key) if key else '**'}: {ast.unparse(each)}"
        return ast.unparse(statement).splitlines()[0]


def _same(node: ast.AST, new: str) -> bool:
    """Whether the new text means what the node is."""
    if isinstance(node, ast.stmt):
        return isinstance(node, ast.Pass)
    if new.startswith("*"):
        return False
    return ast.unparse(ast.parse(f"({new})", mode="eval")) == ast.unparse(node)


def scopes(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Outermost functions and methods with their names; what is nested belongs to them."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            for inner in node.body:
                if isinstance(inner, ast.FunctionDef):
                    yield f"{node.name}.{inner.name}", inner
