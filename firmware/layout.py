"""Names and layout of the emitted C, integer or floating."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Mapping, Sequence

from boresight.model.tools import c_names

#: Words that are illegal as members: keywords of C and C++, macros of the headers in use.
_RESERVED_TEXT = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false NULL offsetof
    asm typeof alignas alignof atomic noreturn thread_local static_assert nullptr constexpr
    and and_eq bitand bitor catch char8_t char16_t char32_t class compl concept const_cast delete
    dynamic_cast explicit export friend mutable namespace new not not_eq operator or or_eq private
    protected public reinterpret_cast requires static_cast template this throw try typeid typename
    using virtual wchar_t xor xor_eq unix linux
"""
RESERVED = frozenset(_RESERVED_TEXT.split())
#: Standard headers: a file of such a name beside the others would be found in place of them.
_HEADERS_TEXT = """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg
    stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time
    uchar wchar wctype
"""
HEADERS = frozenset(_HEADERS_TEXT.split())

#: Macros and types of the standard headers.
RESERVED_PATTERN = re.compile(
    r"u?int\w*_t|(size|ptrdiff|wchar)_t|U?INT\w*_(MAX|MIN|C)|(PTRDIFF|SIZE|SIG_ATOMIC|WCHAR|WINT)_(MAX|MIN|WIDTH)"
)
#: Stems whose ``<stem>_t`` belongs to the standard headers.
_TYPE_STEM = re.compile(r"u?int((_least|_fast)?\d+|ptr|max)|s?size|ptrdiff|wchar|max_align")


def identifier(name: str) -> str:
    """Return a C identifier similar to ``name``.

    Letters, digits and underscores remain, other characters become underscores. Reserved words get
    a suffix, names that begin with a digit a prefix.
    """
    text = c_names.identifier(name)
    return f"{text}_" if text in RESERVED or RESERVED_PATTERN.fullmatch(text) else text


def stem(name: str) -> str:
    """The identifier of a program, which is also the name of its files."""
    text = identifier(name)
    text = f"{text}_" if text.lower() in HEADERS else text
    return f"{text}_program" if _TYPE_STEM.fullmatch(text) else text


#: `model.tools.c_names.unique` of such identifiers.
unique = functools.partial(c_names.unique, fold=False, make=identifier)


def literal(word: int) -> str:
    """A word as an int32_t constant expression."""
    return "INT32_MIN" if word == -(2**31) else str(word)


_RULE = "//" + 78 * "-"
#: Longest line.
_WIDTH = 100

#: Last lines of a file.
END = f"{_RULE}\n// End of file"


def banner(title: str) -> str:
    return f"{_RULE}\n// {title}"


def block(opening: str, lines: Iterable[str]) -> str:
    """Indented lines in braces; too long an opening gets a line for each argument."""
    if max(map(len, opening.splitlines())) + 2 > _WIDTH:
        opening = opening.replace("(", "(\n    ", 1).replace(", ", ",\n    ")
    return "\n".join([f"{opening} {{", *(f"    {line}" if line else "" for line in lines), "}"])


def join(*parts: str) -> str:
    """A file: the parts that are not empty, separated by blank lines."""
    return "\n\n".join(part for part in parts if part) + "\n"


def head(file: str, brief: str, *origin: str) -> str:
    """First comment of a file; ``origin`` names the source."""
    lines = [f"@file {file}", f"@brief {brief}", "", *origin]
    return "\n".join(["/**", *(f" * {line}".rstrip() for line in lines), " */"])


def header(
    name: str,
    first: str,
    *,
    definitions: str,
    members: Mapping[str, Sequence[str]],
    number: str,
    words: str,
    start: str,
) -> str:
    """Text of ``<name>.h``.

    ``members`` are those of the structures ``params``, ``state``, ``in`` and ``out``; ``number`` is
    the C type of a number, ``words`` a text after "inputs of one update", ``start`` one for the
    initial values of the states.
    """

    def struct(kind: str, note: str, lines: Sequence[str]) -> str:
        lines = lines or [f"{number} none; // nothing: C99 has no empty structure"]
        return f"// {note}\n{block('typedef struct', lines)} {name}{kind}_t;"

    guard = f"{name.upper()}_H"
    return join(
        first,
        f"#ifndef {guard}\n#define {guard}",
        banner("Includes"),
        "#include <stdbool.h>\n#include <stdint.h>",
        banner("Definitions"),
        definitions,
        struct("_params", "Parameters: may be changed between updates.", members["params"]),
        struct("_state", "States: all members private.", members["state"]),
        struct("", "Estimator.", [f"{name}_params_t params;", f"{name}_state_t state;"]),
        struct("_in", f"Inputs of one update{words}.", members["in"]),
        struct("_out", "Outputs of one update.", members["out"]),
        banner("Function declarations"),
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"// Sets the parameters to their defaults and the states to their {start}.\n"
        f"void {name}_init({name}_t *self);",
        f"// Sets the states to their {start}.\nvoid {name}_reset({name}_t *self);",
        "// Runs one update.\n"
        f"void {name}_update({name}_t *self, const {name}_in_t *in, {name}_out_t *out);",
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    )


def source(
    name: str,
    first: str,
    *,
    before: Sequence[str],
    params: Sequence[str],
    states: Sequence[str],
    update: Sequence[str],
) -> str:
    """Text of ``<name>.c``; ``before`` precedes its functions, the rest are statements."""
    text = "\n".join(update)
    unused = [f"(void) {word};" for word in ("self", "in", "out") if f"{word}->" not in text]
    return join(
        first,
        banner("Includes"),
        f'#include "{name}.h"',
        *before,
        block(f"void {name}_init({name}_t *const self)", [*params, f"{name}_reset(self);"]),
        block(f"void {name}_reset({name}_t *const self)", states or ["(void) self;"]),
        block(
            f"void {name}_update({name}_t *const self, const {name}_in_t *const in, "
            f"{name}_out_t *const out)",
            [*unused, *update],
        ),
        END,
    )
