"""``<name>_host.c``: entry points that only a host needs (`firmware.build` calls them)."""

from __future__ import annotations

from firmware.body import Body
from firmware.layout import END, banner, block, head, join

__all__ = ["host_source"]


def _load(body: Body, row: str) -> list[str]:
    return [f"in.{member} = inputs[{row}{j}u];" for j, member in enumerate(body.input_members)]


def _set_param(body: Body) -> str:
    cases = [f"case {n}u: self->params.{member} = word; break;"
             for n, member in zip(body.params, body.param_members, strict=True)]
    return "// Sets the parameter with this value number.\n" + block(
        f"void {body.name}_set_param({body.name}_t *const self, const size_t number, "
        "const int32_t word)",
        ["(void) self;", "(void) word;", "switch (number) {",
         *(f"    {case}" for case in [*cases, "default: break;"]), "}"])


def _run(body: Body) -> str:
    name, n_in, n_out = body.name, len(body.program.inputs), len(body.program.outputs)
    store = [f"outputs[k * {n_out}u + {j}u] = out.{member};"
             for j, member in enumerate(body.output_members)]
    loop = [*_load(body, f"k * {n_in}u + "), f"{name}_update(self, &in, &out);", *store,
            "saturated[k] = out.saturated ? 1u : 0u;"]
    return (f"// Runs updates: inputs[n_updates][{n_in}] -> outputs[n_updates][{n_out}], "
            "saturated[n_updates].\n") + block(
        f"void {name}_run({name}_t *const self, const size_t n_updates, "
        "const int32_t *const inputs,\n    int32_t *const outputs, uint8_t *const saturated)",
        ["(void) inputs;", "(void) outputs;", f"{name}_in_t in = {{0}};", f"{name}_out_t out;",
         "for (size_t k = 0u; k < n_updates; k++) {", *(f"    {line}" for line in loop), "}"])


def _words(body: Body) -> str:
    name, values = body.name, body.program.values
    dump = [f"words[{n}] = {body.word(n)}; // {body.describe(n, name=True)}"
            for n in range(len(values))]
    return (f"// Runs one update and gives all its words[{len(values)}]; "
            "states: the words before the update.\n") + block(
        f"void {name}_words({name}_t *const self, const int32_t *const inputs, "
        "int32_t *const words)",
        ["(void) self;", "(void) inputs;", "(void) words;", f"{name}_in_t row = {{0}};",
         f"{name}_in_t *const in = &row;", "(void) in;",
         *(line.replace("in.", "row.", 1) for line in _load(body, "")),
         *body.statements(after=[*dump, "(void) saturated;"], every_word=True)])


def host_source(body: Body) -> str:
    """Text of ``<name>_host.c``."""
    name = body.name
    return join(
        head(body, "_host.c", "Entry points for a host: many updates, every word, parameters."),
        banner("Includes"),
        f"#include \"{name}.c\"\n\n#include <stddef.h>",
        banner("Function declarations"),
        f"size_t {name}_size(void);\n"
        f"void {name}_set_param({name}_t *self, size_t number, int32_t word);\n"
        f"void {name}_run({name}_t *self, size_t n_updates, const int32_t *inputs,\n"
        "    int32_t *outputs, uint8_t *saturated);\n"
        f"void {name}_words({name}_t *self, const int32_t *inputs, int32_t *words);",
        banner("Functions"),
        "// Bytes of an estimator.\n"
        + block(f"size_t {name}_size(void)", [f"return sizeof({name}_t);"]),
        _set_param(body),
        _run(body),
        _words(body),
        END,
    )
