"""``<name>_host.c``: entry points that only a host needs (`build` and `many` call them)."""

from __future__ import annotations

from boresight.firmware.body import Body
from boresight.firmware.layout import END, banner, block, join
from boresight.model.words.program import Op, Overflow

__all__ = ["host_source"]


def _load(body: Body, row: str) -> list[str]:
    return [f"in.{member} = inputs[{row}{j}u];" for j, member in enumerate(body.input_members)]


def _set_param(body: Body) -> str:
    cases = [
        f"case {n}u: self->params.{member} = word; break;"
        for n, member in zip(body.params, body.param_members, strict=True)
    ]
    return "// Sets the parameter with this value number.\n" + block(
        f"void {body.name}_set_param({body.name}_t *const self, const size_t number, "
        "const int32_t word)",
        [
            "(void) self;",
            "(void) word;",
            "switch (number) {",
            *(f"    {case}" for case in [*cases, "default: break;"]),
            "}",
        ],
    )


def _run(body: Body) -> str:
    name, n_in, n_out = body.name, len(body.program.inputs), len(body.program.outputs)
    n_states = len(body.states)
    store = [
        f"outputs[k * {n_out}u + {j}u] = out.{member};"
        for j, member in enumerate(body.output_members)
    ]
    loop = [
        *_load(body, f"k * {n_in}u + "),
        f"{name}_update(self, &in, &out);",
        *store,
        "saturated[k] = out.saturated ? 1u : 0u;",
        "if (states != NULL) {",
        *(
            f"    states[k * {n_states}u + {j}u] = self->state.{member};"
            for j, member in enumerate(body.state_members)
        ),
        "}",
    ]
    return (
        f"// Runs updates: inputs[n_updates][{n_in}] -> outputs[n_updates][{n_out}], "
        "saturated[n_updates],\n"
        f"// and, unless it is NULL, states[n_updates][{n_states}]: the words after each update.\n"
    ) + block(
        f"void {name}_run({name}_t *const self, const size_t n_updates, "
        "const int32_t *const inputs,\n    int32_t *const outputs, uint8_t *const saturated, "
        "int32_t *const states)",
        [
            "(void) inputs;",
            "(void) outputs;",
            f"{name}_in_t in = {{0}};",
            f"{name}_out_t out;",
            "for (size_t k = 0u; k < n_updates; k++) {",
            *(f"    {line}" for line in loop),
            "}",
        ],
    )


def _each(body: Body) -> str:
    name, n_in, n_out = body.name, len(body.program.inputs), len(body.program.outputs)
    return (
        f"// Runs one update of each of n estimators: inputs[n][{n_in}] -> outputs[n][{n_out}], "
        "saturated[n].\n"
    ) + block(
        f"void {name}_each({name}_t *const all, const size_t n, const int32_t *const inputs,\n"
        "    int32_t *const outputs, uint8_t *const saturated)",
        [
            "for (size_t k = 0u; k < n; k++) {",
            f"    {name}_run(&all[k], 1u, inputs + k * {n_in}u, outputs + k * {n_out}u, "
            "saturated + k, NULL);",
            "}",
        ],
    )


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
            *(line.replace("in.", "row.", 1) for line in _load(body, "")),
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


def host_source(body: Body) -> str:
    """Text of ``<name>_host.c``."""
    name = body.name
    return join(
        body.head("_host.c", "Entry points for a host: many updates, many estimators, every word."),
        banner("Includes"),
        f'#include "{name}.c"\n\n#include <stddef.h>',
        banner("Function declarations"),
        f"size_t {name}_size(void);\n"
        f"void {name}_set_param({name}_t *self, size_t number, int32_t word);\n"
        f"void {name}_run({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *outputs, uint8_t *saturated, int32_t *states);\n"
        f"void {name}_each({name}_t *all, size_t n, const int32_t *inputs, int32_t *outputs,\n"
        "    uint8_t *saturated);\n"
        f"void {name}_observe({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *low, int32_t *high, int64_t *low_at, int64_t *high_at,\n"
        "    int64_t *saturations);",
        banner("Functions"),
        "// Bytes of an estimator.\n"
        + block(f"size_t {name}_size(void)", [f"return sizeof({name}_t);"]),
        _set_param(body),
        _run(body),
        _each(body),
        _every_word(body),
        _observe(body),
        END,
    )
