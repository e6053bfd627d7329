"""Layout of the emitted C, integer or floating: file heads, sections, interface and functions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

_RULE = "//" + 78 * "-"
#: Longest line.
_WIDTH = 100

#: Last lines of a file.
END = f"{_RULE}\n// End of file"


def banner(title: str) -> str:
    """Heading of a section."""
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

    Parameters
    ----------
    members : mapping
        Members of the structures ``params``, ``state``, ``in`` and ``out``.
    number : str
        C type of a number.
    words, start : str
        Text after "inputs of one update"; initial values of the states in words.
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
