"""Validation of emitted C: the text computes the program's results, for all inputs.

`<name>.h` and `<name>.c` are parsed (pycparser), ``update`` is executed on terms, statement by
statement, and each output, next state and the flag must be the term that the program's operations
define (`model.words.terms`). Tables, first words, the order of the structures' members and the
widths in the macros are compared, too. The functions that the statements call
(`firmware.helpers`) must be there unchanged; what they compute is shown by tests.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from pycparser import CParser, c_ast
from pycparser.c_parser import ParseError

from boresight.firmware.helpers import helpers
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


def validate_c(program: Program, name: str, texts: Mapping[str, str]) -> int:
    """Prove that emitted C computes its program; return the number of its operations.

    Parameters
    ----------
    program : Program
        The source program.
    name : str
        Prefix of the files and functions.
    texts : mapping
        Texts of ``<name>.h`` and ``<name>.c`` by file name, as `firmware.emit.emit_c` returns them.

    Raises
    ------
    Refuted
        Some word differs for some input, or the text is not what the validation can read.
    """
    try:
        _File(program, name, texts).check()
    except (_Unread, ParseError, AttributeError, KeyError, ValueError) as error:
        raise Refuted(f"{name}.c cannot be read back: {error}") from error
    return len(program.ops)


class _Unread(Exception):
    """A statement that the emitter does not write."""


def _parsed(text: str) -> c_ast.FileAST:
    code = _DIRECTIVE.sub("", _COMMENT.sub("", text)).replace('extern "C" {', "")
    return CParser().parse(code)


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


class _File:
    """The parsed files of one program."""

    def __init__(self, program: Program, name: str, texts: Mapping[str, str]) -> None:
        self.program = program
        self.name = name
        text = texts[f"{name}.c"]
        macros = {k: _COMMENT.sub("", v).strip() for k, v in _MACRO.findall(text)}
        if macros != _widths(program.arithmetic):
            raise _Unread(f"the macros must be those of {program.arithmetic}, not {macros}")
        body = _HELPERS.split(text)
        called = (body[1] or "") if len(body) == 3 else ""
        if called != helpers(f"void {body[-1]}"):
            raise _Unread("the functions before init must be those of firmware.helpers")
        header = _DIRECTIVE.sub("", texts[f"{name}.h"]).rsplit("}", 1)[0]
        source = text.replace(called, "") if called else text
        file = _parsed(f"{_TYPES}{header}\n{source}")
        self.functions = {x.decl.name: x for x in file.ext if isinstance(x, c_ast.FuncDef)}
        self.members = {
            x.name: [d.name for d in x.type.type.decls]
            for x in file.ext
            if isinstance(x, c_ast.Typedef) and isinstance(x.type.type, c_ast.Struct)
        }
        #: Words of each array, and their declared number.
        self.tables = {
            x.name: ([_integer(w) for w in x.init.exprs], _integer(x.type.dim))
            for x in file.ext
            if isinstance(x, c_ast.Decl) and isinstance(x.type, c_ast.ArrayDecl)
        }

    def check(self) -> None:
        """Raise Refuted unless all that the files compute is the program's."""
        p, terms = self.program, Terms(self.program.arithmetic)
        states = [state for state, _ in p.states]
        params = p.of_kind(Kind.PARAM)
        places = {
            **self._places("in", "in", p.inputs),
            **self._places("params", "self.params", params),
            **self._places("state", "self.state", states),
        }
        self._check_first("init", "self.params", {x: n for x, n in places.items() if n in params})
        self._check_first("reset", "self.state", {x: n for x, n in places.items() if n in states})
        table = {"TABLE": (list(p.table_memory), len(p.table_memory))}
        read = any(term.coefficient is not None for op in p.ops for term in op.terms)
        if self.tables != (table if read else {}):
            raise Refuted(f"{self.name}.c: the words of TABLE must be the program's")
        symbols = {n: terms.symbol(p.values[n].name, n) for n in places.values()}
        meaning = Meaning.of(p, terms, symbols)
        update = _Update(terms, {place: symbols[n] for place, n in places.items()})
        for statement in self._body("update"):
            update.run(statement)
            self._check_local(statement, update, meaning)
        outputs = self._places("out", "out", range(len(p.outputs)), extra=_FLAGS)
        following = dict(p.states)
        wanted = {place: meaning.values[p.outputs[k]] for place, k in outputs.items()}
        wanted |= {
            place: meaning.values[following[n]] for place, n in places.items() if n in following
        }
        wanted |= {place: symbols[n] for place, n in places.items() if n not in following}
        for place, term in wanted.items():
            if update.places.get(place) != term:
                word = update.places.get(place)
                raise Refuted(
                    f"{self.name}.c: {place} must be {terms.text(term)}, "
                    f"not {'undefined' if word is None else terms.text(word)}"
                )
        if update.flagged != meaning.flagged or update.flags_written != {*_FLAGS}:
            raise Refuted(f"{self.name}.c: {' and '.join(_FLAGS)} must be those of all results")

    def _check_local(self, statement: c_ast.Node, update: _Update, meaning: Meaning) -> None:
        """Check a local word, ``v<number of the value>_<name>``, so that the first is named."""
        if isinstance(statement, c_ast.Decl) and (local := _LOCAL.match(statement.name)):
            word, wanted = update.places[statement.name], meaning.values[int(local[1])]
            if word != wanted:
                text = update.terms.text
                raise Refuted(
                    f"{self.name}.c: {statement.name} must be {text(wanted)}, not {text(word)}"
                )

    def _places(
        self, struct: str, prefix: str, numbers: Sequence[int], extra: Sequence[str] = ()
    ) -> dict[str, int]:
        """Members of a structure with their values, in order."""
        members = self.members[f"{self.name}_{struct}_t"]
        if not numbers and members == ["none"]:
            return {}
        if len(members) != len(numbers) + len(extra) or members[len(numbers) :] != list(extra):
            raise _Unread(f"{struct} must have {len(numbers)} words, not {members}")
        return {f"{prefix}.{m}": n for m, n in zip(members, numbers, strict=False)}

    def _body(self, function: str) -> list[c_ast.Node]:
        return self.functions[f"{self.name}_{function}"].body.block_items or []

    def _check_first(self, function: str, prefix: str, places: Mapping[str, int]) -> None:
        """Check the words that a function assigns, once each."""
        first: dict[str, int] = {}
        calls = []
        for statement in self._body(function):
            if isinstance(statement, c_ast.Assignment) and statement.op == "=":
                first[_place(statement.lvalue)] = _integer(statement.rvalue)
            elif isinstance(statement, c_ast.FuncCall):
                calls.append(statement.name.name)
            elif not isinstance(statement, c_ast.Cast):
                raise _Unread(f"line {statement.coord}: not an assignment")
        if calls != [f"{self.name}_reset"] * (function == "init"):
            raise _Unread(f"{function} must call reset once, in init")
        wanted = {place: self.program.values[n].initial for place, n in places.items()}
        if first != wanted:
            place = min(k for k in first.keys() | wanted.keys() if first.get(k) != wanted.get(k))
            raise Refuted(
                f"{self.name}.c: {function} must set {place} to {wanted.get(place)}, "
                f"not {first.get(place)}"
            )


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
        self.flag = self.count = self.index = -1
        self.block = -1

    def run(self, statement: c_ast.Node) -> None:
        """Execute one statement."""
        if isinstance(statement, c_ast.Cast):
            return
        if isinstance(statement, c_ast.Decl):
            if statement.init is not None and statement.name not in _FLAGS:
                self.places[statement.name] = self._word(statement.init)
            elif statement.init is not None and _text(statement.init) != "false":
                raise _Unread(f"{statement.name} must begin as false")
            return
        if not isinstance(statement, c_ast.Assignment):
            raise _Unread(f"{type(statement).__name__} is no statement of an update")
        place = _place(statement.lvalue)
        if place in ("acc", "flag", "n", "segment"):
            getattr(self, f"_set_{place}")(statement.op, statement.rvalue)
        elif statement.op != "=":
            raise _Unread(f"{place} {statement.op}")
        elif (flag := place.removeprefix("out.")) in _FLAGS:
            if _text(statement.rvalue) != flag:
                raise _Unread(f"{place} must be {flag}")
            self.flags_written.add(flag)
        else:
            self.places[place] = self._word(statement.rvalue)

    def _set_acc(self, op: str, value: c_ast.Node) -> None:
        if op == "=" and _text(value) == "ROUND":
            self.acc = None
            return
        if op not in ("+=", "-="):
            raise _Unread(f"acc {op}")
        take: Condition = ALWAYS
        negate: Condition = (True, None) if op == "-=" else NEVER
        if isinstance(value, c_ast.BinaryOp) and value.op == "&":
            take, value = self._mask(value.right), value.left
        function, arguments = _call(value)
        if function == "negate_where":
            if negate != NEVER:
                raise _Unread("acc -= negate_where")
            value, mask = arguments
            negate = self._mask(mask)
            function, arguments = _call(value)
        if function != "mul_shift":
            raise _Unread(f"{function} in a sum")
        a, b, amount = arguments
        product = self.terms.product(self._word(a), self._word(b))
        shifted = self.terms.shifted(product, self._amount(amount))
        self.acc = self.terms.total(self.acc, shifted, negate, take)

    def _set_flag(self, op: str, value: c_ast.Node) -> None:
        function, (word,) = _call(value)
        quarter = {"sign_mask": False, "sign_mask_quarter": True}[function]
        self.flag = self.terms.sign(self._word(word), quarter=quarter)

    def _set_n(self, op: str, value: c_ast.Node) -> None:
        function, (word,) = _call(value)
        if function != "sign_count":
            raise _Unread(f"n = {function}")
        self.count = self.terms.count(self._word(word))

    def _set_segment(self, op: str, value: c_ast.Node) -> None:
        """``segment = &TABLE[512u + 4u * segment_index(x)]``."""
        place = value.expr.subscript
        function, (word,) = _call(place.right.right)
        quarter = {"segment_index": False, "segment_index_quarter": True}[function]
        base, step = _integer(place.left), _integer(place.right.left)
        operators = (value.op, place.op, place.right.op, value.expr.name.name)
        if operators != ("&", "+", "*", "TABLE") or step != 4 or base % 512:
            raise _Unread("segment must be &TABLE[512 * block + 4 * index]")
        self.block = base // 512
        self.index = self.terms.index(self._word(word), quarter=quarter)

    def _mask(self, value: c_ast.Node) -> Condition:
        inverted = isinstance(value, c_ast.UnaryOp) and value.op == "~"
        if _text(value.expr if inverted else value) != "flag":
            raise _Unread("a condition must be flag or ~flag")
        return inverted, self.flag

    def _amount(self, value: c_ast.Node) -> int:
        if isinstance(value, c_ast.Constant):
            return self.terms.amount(_integer(value))
        function, (shift, count) = _call(value)
        scale = Scale.FULL
        if isinstance(count, c_ast.BinaryOp):
            scale = {("&", "~1"): Scale.EVEN, (">>", "1"): Scale.HALF}[
                count.op, _text(count.right).rstrip("u")
            ]
            count = count.left
        if function != "shift_less" or _text(count) != "n":
            raise _Unread("a shift must be a constant or shift_less(constant, n)")
        return self.terms.amount(_integer(shift), scale, self.count)

    def _word(self, value: c_ast.Node) -> int:
        """Term of an expression that is a word."""
        if isinstance(value, c_ast.ArrayRef):
            if _text(value.name) != "segment":
                raise _Unread(f"{_text(value.name)}[]")
            return self.terms.coefficient(self.block, _integer(value.subscript), self.index)
        if isinstance(value, c_ast.FuncCall):
            return self._result(*_call(value))
        if isinstance(value, c_ast.Constant | c_ast.UnaryOp) or _text(value) == "INT32_MIN":
            return self.terms.word(_integer(value))
        place = _place(value)
        if place not in self.places:
            raise _Unread(f"{place} is read before it is written")
        return self.places[place]

    def _result(self, function: str, arguments: list[c_ast.Node]) -> int:
        if function == "fraction":
            return self.terms.fraction(self._word(arguments[0]))
        flag = {"saturate": ["&saturated"], "overflow": ["&beyond"]}.get(function, [])
        if not flag and function not in ("clip", "wrap") or self.acc is None:
            raise _Unread(f"{function} of a word")
        if [_text(x) for x in arguments] != ["acc", *flag]:
            raise _Unread(f"{function} must be of acc")
        word = self.terms.result(self.acc, wrap=function in ("wrap", "overflow"))
        if flag and self.terms.may_overflow(word):
            self.flagged.add(word)
            self.flags_written.clear()
        return word


def _call(value: c_ast.Node) -> tuple[str, list[c_ast.Node]]:
    if not isinstance(value, c_ast.FuncCall):
        raise _Unread(f"{type(value).__name__} where a function is called")
    return value.name.name, value.args.exprs


def _place(value: c_ast.Node) -> str:
    """Name of a variable or of a member: ``self.state.x``."""
    if isinstance(value, c_ast.StructRef):
        return f"{_place(value.name)}.{value.field.name}"
    return _text(value)


def _text(value: c_ast.Node) -> str:
    if isinstance(value, c_ast.UnaryOp):
        return f"{value.op}{_text(value.expr)}"
    return str(getattr(value, "name", None) or getattr(value, "value", type(value).__name__))


def _integer(value: c_ast.Node) -> int:
    """An integer constant."""
    text = _text(value)
    if text == "INT32_MIN":
        return -(2**31)
    try:
        return int(text.rstrip("u"))
    except ValueError:
        raise _Unread(f"{text} where a constant is wanted") from None
