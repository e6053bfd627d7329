"""``<name>_observe.c``: updates that record every word (called by `build.CModel.observe`).

It is a separate library, built on demand, since it contains a second update besides that of
``<name>.c``, half of the compiler's work.
"""

from __future__ import annotations

from boresight.firmware.body import Body
from boresight.firmware.emit import preamble
from boresight.firmware.host import load
from boresight.firmware.layout import END, banner, block, join
from boresight.model.words.program import Op, Overflow


def _every_word(body: Body) -> str:
    name, values = body.name, body.program.values
    dump = [
        f"words[{n}] = {body.word(n)}; // {body.describe(n, name=True)}" for n in range(len(values))
    ]

    def count(op: Op) -> list[str]:
        return (
            [f"saturations[{op.dest}] += saturated ? 1 : 0;", "saturated = false;"]
            if op.overflow is Overflow.SAT
            else []
        )

    return (
        f"// Runs one update and gives all its words[{len(values)}]; "
        "states: the words before the update.\n"
        "// Adds one to saturations[n] of each value n that was clamped.\n"
    ) + block(
        f"static void {name}_every_word({name}_t *const self, const int32_t *const inputs,\n"
        "    int32_t *const words, int64_t *const saturations)",
        [
            "(void) self;",
            "(void) inputs;",
            "(void) words;",
            "(void) saturations;",
            f"{name}_in_t row = {{0}};",
            f"{name}_in_t *const in = &row;",
            "(void) in;",
            *(line.replace("in.", "row.", 1) for line in load(body, "")),
            *body.statements(after=[*dump, "(void) saturated;"], every_word=True, behind=count),
        ],
    )


def _observe(body: Body) -> str:
    name, n_in, n = body.name, len(body.program.inputs), len(body.program.values)
    track = [f"for (size_t n = 0u; n < {n}u; n++) {{"]
    for end, sign in (("low", "<"), ("high", ">")):
        track += [
            f"    if (words[n] {sign} {end}[n]) {{",
            f"        {end}[n] = words[n];",
            f"        {end}_at[n] = (int64_t) k;",
            "    }",
        ]
    track.append("}")
    return (
        f"// Runs updates: inputs[n_updates][{n_in}]; for each of the {n} values: narrows low "
        "and high to\n// its least and largest word, with the update that first had it, and "
        "counts its saturations.\n"
    ) + block(
        f"void {name}_observe({name}_t *const self, const size_t n_updates, "
        "const int32_t *const inputs,\n    int32_t *const low, int32_t *const high, "
        "int64_t *const low_at, int64_t *const high_at,\n    int64_t *const saturations)",
        [
            "(void) low;",
            "(void) high;",
            "(void) low_at;",
            "(void) high_at;",
            f"int32_t words[{max(n, 1)}];",
            "for (size_t k = 0u; k < n_updates; k++) {",
            f"    {name}_every_word(self, inputs + k * {n_in}u, words, saturations);",
            *(f"    {line}" for line in track if n),
            "}",
        ],
    )


def observe_source(body: Body) -> str:
    """Text of ``<name>_observe.c``, which needs only ``<name>.h``."""
    name, every = body.name, _every_word(body)
    return join(
        body.head("_observe.c", "Every word of an update, for a host."),
        banner("Includes"),
        f'#include "{name}.h"\n\n#include <stddef.h>',
        *preamble(body, every),
        f"void {name}_observe({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *low, int32_t *high, int64_t *low_at, int64_t *high_at,\n"
        "    int64_t *saturations);",
        every,
        _observe(body),
        END,
    )
