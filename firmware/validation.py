"""Validation of emitted C: the text computes the program's results, for all inputs.

`<name>.h` and `<name>.c` are parsed (pycparser), ``update`` is executed on terms, statement by
statement, and each output, next state and the flag must be the term that the program's operations
define (`model.words.terms`). Tables, first words, types, the order of the structures' members and
the numbers in the macros are compared, too. The functions that the statements call
(`firmware.helpers`) must be there unchanged; what they compute is shown by tests.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pycparser import CParser, c_ast
from pycparser.c_parser import ParseError

from boresight.firmware.helpers import helpers
from boresight.firmware.names import stem
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Program, Scale
from boresight.model.words.terms import ALWAYS, NEVER, Condition, Meaning, Refuted, Terms

#: Flags of an update, local variables and members of ``out``.
_FLAGS = ("saturated", "beyond")
#: Declarations of the standard headers.
_TYPES = "".join(
    f"typedef int {name};" for name in ("int32_t", "int64_t", "uint32_t", "uint64_t", "bool")
)
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_DIRECTIVE = re.compile(r"(?m)^#.*$")
_MACRO = re.compile(r"(?m)^#define (\w+) (.+)$")
_LOCAL = re.compile(r"v(\d+)_")
_HELPERS = re.compile(r"(?s)\n// Functions\n\n(?:(.*?)\n\n)??void ")


def validate_c(program: Program, texts: Mapping[str, str]) -> int:
    """Prove that emitted C computes its program; return the number of its operations.

    ``texts`` are those of `firmware.emit.emit_c`. Raises Refuted if some word differs for some
    input, or if the text cannot be read back.
    """
    name = stem(program.name)
    try:
        _check(program, _File(program, name, texts))
    except (_Unread, ParseError, AttributeError, KeyError, ValueError) as error:
        raise Refuted(f"{name}.c cannot be read back: {error}") from error
    return len(program.ops)


class _Unread(Exception):
    """A statement that the emitter does not write."""


def _widths(arith: Arithmetic) -> dict[str, str]:
    """Macros that the functions use."""
    return {
        "WORD": f"({arith.word}u)",
        "GUARD": f"({arith.guard}u)",
        "ROUND": f"(UINT64_C({2 ** (arith.guard - 1)}))",
        "WORD_MAX": f"(INT64_C({2 ** (arith.word - 1) - 1}))",
        "WORD_MIN": "(-WORD_MAX - 1)",
        "NORM_MAX": f"({arith.word - 2 - arith.guard}u)",
        "QUARTER": f"(UINT32_C({2 ** (arith.word - 2)}))",
        "FRACTION_BITS": f"({arith.word - 1 - 7}u)",
        "FRACTION_MASK": f"(UINT32_C({2 ** (arith.word - 1 - 7) - 1}))",
        "INDEX_MASK": f"(UINT32_C({2**7 - 1}))",
    }


def _plain(node: c_ast.Node) -> Any:
    """A statement or expression: (operator or function, operands), None if it has no effect.

    Names and members are strings (``self.state.x``), constants integers.
    """
    match node:
        case c_ast.Constant():
            return int(node.value.rstrip("u"))
        case c_ast.ID():
            return -(2**31) if node.name == "INT32_MIN" else node.name
        case c_ast.StructRef():
            return f"{_plain(node.name)}.{node.field.name}"
        case c_ast.UnaryOp(op="-", expr=c_ast.Constant()):
            return -_plain(node.expr)
        case c_ast.UnaryOp():
            return node.op, _plain(node.expr)
        case c_ast.BinaryOp():
            return node.op, _plain(node.left), _plain(node.right)
        case c_ast.ArrayRef():
            return "[]", _plain(node.name), _plain(node.subscript)
        case c_ast.FuncCall():
            return node.name.name, *map(_plain, node.args.exprs)
        case c_ast.Assignment():
            return node.op, _plain(node.lvalue), _plain(node.rvalue)
        case c_ast.Decl():
            _check_type(node, _LOCALS.get(node.name, "int32_t"))
            return None if node.init is None else ("declare", node.name, _plain(node.init))
        case c_ast.Cast():
            return None
    raise _Unread(f"{type(node).__name__} is no part of an update")


#: Types of the local variables that are no words.
_LOCALS = dict.fromkeys(_FLAGS, "bool") | {
    **dict.fromkeys(("acc", "flag"), "uint64_t"),
    **{"n": "uint32_t", "segment": "int32_t *"},
}


def _check_type(node: c_ast.Decl, wanted: str) -> None:
    """Raise _Unread if a declaration has another type."""
    kind, stars = node.type, ""
    while isinstance(kind, c_ast.PtrDecl | c_ast.ArrayDecl):
        stars += " *" * isinstance(kind, c_ast.PtrDecl)
        kind = kind.type
    if (found := " ".join(kind.type.names) + stars) != wanted:
        raise _Unread(f"{node.name} must be {wanted}, not {found}")


class _File:
    """The parsed files of one program: its structures, tables, and the bodies of its functions."""

    def __init__(self, program: Program, name: str, texts: Mapping[str, str]) -> None:
        self.name, text = name, texts[f"{name}.c"]
        macros = {k: _COMMENT.sub("", v).strip() for k, v in _MACRO.findall(text)}
        if macros != _widths(program.arithmetic):
            raise _Unread(f"the macros must be those of {program.arithmetic}, not {macros}")
        body = _HELPERS.split(text)
        called = (body[1] or "") if len(body) == 3 else ""
        if called != helpers(f"void {body[-1]}"):
            raise _Unread("the functions before init must be those of firmware.helpers")
        header = _DIRECTIVE.sub("", texts[f"{name}.h"]).rsplit("}", 1)[0]
        code = f"{_TYPES}{header}\n{text.replace(called, '') if called else text}"
        code = _DIRECTIVE.sub("", _COMMENT.sub("", code)).replace('extern "C" {', "")
        self.bodies: dict[str, list[Any]] = {}
        self.members: dict[str, list[str]] = {}
        #: Numbers in the macros of the header.
        self.published = {
            k: _COMMENT.sub("", v).strip("() ") for k, v in _MACRO.findall(texts[f"{name}.h"])
        }
        #: Words of each array, and their declared number.
        self.tables: dict[str, tuple[list[int], int]] = {}
        for x in CParser().parse(code).ext:
            if isinstance(x, c_ast.FuncDef):
                self.bodies[x.decl.name] = [*map(_plain, x.body.block_items or [])]
            elif isinstance(x, c_ast.Typedef) and isinstance(x.type.type, c_ast.Struct):
                members = x.type.type.decls
                self.members[x.name] = [d.name for d in members]
                for k, member in enumerate(members):
                    is_flag = x.name == f"{name}_out_t" and k >= len(members) - len(_FLAGS)
                    word = "bool" if is_flag else "int32_t"
                    own = f"{name}_{member.name}_t" if x.name == f"{name}_t" else word
                    _check_type(member, own)
            elif isinstance(x, c_ast.Decl) and isinstance(x.type, c_ast.ArrayDecl):
                _check_type(x, "int32_t")
                self.tables[x.name] = [*map(_plain, x.init.exprs)], _plain(x.type.dim)

    def body(self, function: str) -> list[Any]:
        """Statements of a function that have an effect."""
        return [s for s in self.bodies[f"{self.name}_{function}"] if s is not None]

    def places(
        self, struct: str, prefix: str, numbers: Sequence[int], extra: Sequence[str] = ()
    ) -> dict[str, int]:
        """Members of a structure with their values, in order."""
        members = self.members[f"{self.name}_{struct}_t"]
        if not numbers and members == ["none"]:
            return {}
        if len(members) != len(numbers) + len(extra) or members[len(numbers) :] != list(extra):
            raise _Unread(f"{struct} must have {len(numbers)} words, not {members}")
        return {f"{prefix}.{m}": n for m, n in zip(members, numbers, strict=False)}


def _check(p: Program, file: _File) -> None:
    """Raise Refuted unless all that the files compute is the program's."""
    terms, following = Terms(p.arithmetic), dict(p.states)
    params = file.places("params", "self.params", p.of_kind(Kind.PARAM))
    states = file.places("state", "self.state", [*following])
    places = {**file.places("in", "in", p.inputs), **params, **states}
    outputs = file.places("out", "out", range(len(p.outputs)), extra=_FLAGS)

    def same(place: str, wanted: Any, found: Any, text: Callable[[Any], str] = str) -> None:
        if found != wanted:
            said = "undefined" if found is None else text(found)
            raise Refuted(f"{file.name}.c: {place} must be {text(wanted)}, not {said}")

    for function, first in (("init", params), ("reset", states)):
        body: list[Any] = [("=", place, p.values[n].initial) for place, n in first.items()]
        calls = [(f"{file.name}_reset", "self")] if function == "init" else []
        same(function, body + calls, file.body(function))
    sizes = {"WORD": p.arithmetic.word, "INPUTS": len(p.inputs), "OUTPUTS": len(p.outputs)}
    words = (*p.inputs, *p.of_kind(Kind.PARAM), *p.outputs)
    published = [
        f'"{p.digest}"',
        *map(str, sizes.values()),
        *(str(p.values[n].frac) for n in words),
    ]
    same("the macros of the header", published, [*file.published.values()])
    read = any(term.coefficient is not None for op in p.ops for term in op.terms)
    table = {"TABLE": ([*p.table_memory], len(p.table_memory))} if read else {}
    same("the tables", table, file.tables)
    symbols = {n: terms.symbol(p.values[n].name, n) for n in places.values()}
    meaning = Meaning.of(p, terms, symbols)
    update = _Update(terms, {place: symbols[n] for place, n in places.items()})
    for statement in file.body("update"):
        update.run(statement)
        # A local word is v<number of the value>_<name>; so the first that differs is named.
        if statement[0] == "declare" and (local := _LOCAL.match(statement[1])):
            wanted = meaning.values[int(local[1])]
            same(statement[1], wanted, update.places[statement[1]], terms.text)
    after = {place: meaning.values[p.outputs[k]] for place, k in outputs.items()}
    for place, n in places.items():
        after[place] = meaning.values[following[n]] if n in following else symbols[n]
    for place, term in after.items():
        same(place, term, update.places.get(place), terms.text)
    same("the results that raise flags", meaning.flagged, update.flagged)
    same("the flags of out", {*_FLAGS}, update.flags_written)


class _Update:
    """The state of ``update`` after each of its statements, on terms."""

    def __init__(self, terms: Terms, places: Mapping[str, int]) -> None:
        self.terms = terms
        #: Members of structures, and local words.
        self.places = dict(places)
        self.flagged: set[int] = set()
        #: Members of ``out`` with the flags, written after the last result that raises one.
        self.flags_written: set[str] = set()
        #: The sum, None for the rounding half.
        self.acc: int | None = terms.symbol("acc undefined")
        self.flag = self.count = self.index = self.block = -1

    def run(self, statement: Any) -> None:
        """Execute one statement."""
        terms = self.terms
        match statement:
            case ("=", "acc", "ROUND"):
                self.acc = None
            case ("+=" | "-=" as sign, "acc", term):
                self._add(term, (True, None) if sign == "-=" else NEVER)
            case ("=", "flag", (str(function), word)):
                quarter = {"sign_mask": False, "sign_mask_quarter": True}[function]
                self.flag = terms.sign(self._word(word), quarter=quarter)
            case ("=", "n", ("sign_count", word)):
                self.count = terms.count(self._word(word))
            case ("=", "segment", ("&", ("[]", "TABLE", ("+", int(base), ("*", 4, index))))):
                function, word = index if isinstance(index, tuple) else (index, "")
                quarter = {"segment_index": False, "segment_index_quarter": True}[function]
                self.block, rest = divmod(base, 512)
                self.index = terms.index(self._word(word), quarter=quarter)
                if rest:
                    raise _Unread("segment must be &TABLE[512 * block + 4 * index]")
            case ("declare", "saturated" | "beyond", "false"):
                pass
            case ("=", "out.saturated" | "out.beyond" as place, flag) if place == f"out.{flag}":
                self.flags_written.add(flag)
            case ("=" | "declare", str(place), value) if place not in _SPECIAL:
                self.places[place] = self._word(value)
            case _:
                raise _Unread(f"{statement} is no statement of an update")

    def _add(self, term: Any, negate: Condition) -> None:
        """Add or subtract a term."""
        take: Condition = ALWAYS
        match term:
            case ("&", inner, mask):
                take, term = self._mask(mask), inner
        match term:
            case ("negate_where", inner, mask) if negate == NEVER:
                negate, term = self._mask(mask), inner
        match term:
            case ("mul_shift", a, b, amount):
                product = self.terms.product(self._word(a), self._word(b))
                shifted = self.terms.shifted(product, self._amount(amount))
                self.acc = self.terms.total(self.acc, shifted, negate, take)
            case _:
                raise _Unread(f"{term} in a sum")

    def _mask(self, value: Any) -> Condition:
        return {"flag": False, ("~", "flag"): True}[value], self.flag

    def _amount(self, value: Any) -> int:
        match value:
            case int():
                return self.terms.amount(value)
            case ("shift_less", int(shift), count):
                scales = {"n": Scale.FULL, ("&", "n", ("~", 1)): Scale.EVEN}
                scale = (scales | {(">>", "n", 1): Scale.HALF})[count]
                return self.terms.amount(shift, scale, self.count)
        raise _Unread("a shift must be a constant or shift_less(constant, n)")

    def _word(self, value: Any) -> int:
        """Term of an expression that is a word."""
        match value:
            case int():
                return self.terms.word(value)
            case str() if value in self.places:
                return self.places[value]
            case ("[]", "segment", int(coefficient)):
                return self.terms.coefficient(self.block, coefficient, self.index)
            case ("fraction", word):
                return self.terms.fraction(self._word(word))
            case ("clip" | "wrap" as function, "acc") if self.acc is not None:
                return self.terms.result(self.acc, wrap=function == "wrap")
            case ("saturate", "acc", ("&", "saturated")) | ("overflow", "acc", ("&", "beyond")) if (
                self.acc is not None
            ):
                word = self.terms.result(self.acc, wrap=value[0] == "overflow")
                if self.terms.may_overflow(word):
                    self.flagged.add(word)
                    self.flags_written.clear()
                return word
        raise _Unread(f"{value} is no word")


#: Variables that are no words.
_SPECIAL = ("acc", "flag", "n", "segment", *_FLAGS, *(f"out.{flag}" for flag in _FLAGS))
