"""``<name>_host.c``: entry points for a host only (called by `build`)."""

from __future__ import annotations

from boresight.firmware.body import Body
from boresight.firmware.layout import END, banner, block, join


def load(body: Body, row: str) -> list[str]:
    """Statements that fill ``in`` from ``inputs``, whose index begins with ``row``."""
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
        *load(body, f"k * {n_in}u + "),
        f"{name}_update(self, &in, &out);",
        *store,
        "flags[k] = (uint8_t) ((out.saturated ? 1u : 0u) | (out.beyond ? 2u : 0u));",
        "if (states != NULL) {",
        *(
            f"    states[k * {n_states}u + {j}u] = self->state.{member};"
            for j, member in enumerate(body.state_members)
        ),
        "}",
    ]
    return (
        f"// Runs updates: inputs[n_updates][{n_in}] -> outputs[n_updates][{n_out}], "
        "flags[n_updates],\n"
        f"// and, unless it is NULL, states[n_updates][{n_states}]: the words after each update.\n"
    ) + block(
        f"void {name}_run({name}_t *const self, const size_t n_updates, "
        "const int32_t *const inputs,\n    int32_t *const outputs, uint8_t *const flags, "
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
        "flags[n].\n"
    ) + block(
        f"void {name}_each({name}_t *const all, const size_t n, const int32_t *const inputs,\n"
        "    int32_t *const outputs, uint8_t *const flags)",
        [
            "for (size_t k = 0u; k < n; k++) {",
            f"    {name}_run(&all[k], 1u, inputs + k * {n_in}u, outputs + k * {n_out}u, "
            "flags + k, NULL);",
            "}",
        ],
    )


def host_source(body: Body) -> str:
    """Text of ``<name>_host.c``."""
    name = body.name
    return join(
        body.head("_host.c", "Entry points for a host: many updates, many estimators."),
        banner("Includes"),
        f'#include "{name}.c"\n\n#include <stddef.h>',
        banner("Function declarations"),
        f"size_t {name}_size(void);\n"
        f"void {name}_set_param({name}_t *self, size_t number, int32_t word);\n"
        f"void {name}_run({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *outputs, uint8_t *flags, int32_t *states);\n"
        f"void {name}_each({name}_t *all, size_t n, const int32_t *inputs, int32_t *outputs,\n"
        "    uint8_t *flags);",
        banner("Functions"),
        "// Bytes of an estimator.\n"
        + block(f"size_t {name}_size(void)", [f"return sizeof({name}_t);"]),
        _set_param(body),
        _run(body),
        _each(body),
        END,
    )
