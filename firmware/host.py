"""C for a host alone: many updates in one call, and every word of an update (called by `build`)."""

from __future__ import annotations

from collections.abc import Iterator

from boresight.firmware.body import Body
from boresight.firmware.emit import preamble
from boresight.model.words.program import Op, Overflow

_HOST = """\
#include "@name@.c"

#include <stddef.h>
#include <string.h>

size_t @name@_size(void);
void @name@_run(@name@_t *all, size_t runs, size_t updates, const @number@ *inputs,
    @number@ *outputs, unsigned char *flags, @number@ *states);

// Bytes of an estimator.
size_t @name@_size(void) {
    return sizeof(@name@_t);
}

// Runs updates of several estimators: inputs[updates][runs][] -> outputs[updates][runs][],
// flags[updates][runs], and, unless it is NULL, states[updates][runs][]: the words after each
// update. Each structure begins with consecutive numbers.
void @name@_run(@name@_t *const all, const size_t runs, const size_t updates,
    const @number@ *inputs, @number@ *outputs, unsigned char *flags, @number@ *states) {
    @name@_in_t in = {0};
    @name@_out_t out;
    for (size_t k = 0u; k < updates; k++) {
        for (size_t j = 0u; j < runs; j++) {
            memcpy(&in, inputs, @macro@_INPUTS * sizeof *inputs);
            @name@_update(&all[j], &in, &out);
            memcpy(outputs, &out, @macro@_OUTPUTS * sizeof *outputs);
            inputs += @macro@_INPUTS;
            outputs += @macro@_OUTPUTS;
            *flags++ = (unsigned char) (@flags@);
            if (states != NULL) {
                memcpy(states, &all[j].state, @states@u * sizeof *states);
                states += @states@u;
            }
        }
    }
}
"""
_OBSERVE = """\
#include "@name@.h"

#include <stddef.h>
#include <string.h>

@preamble@

void @name@_observe(@name@_t *self, size_t updates, const int32_t *inputs, int32_t *low,
    int32_t *high, int64_t *low_at, int64_t *high_at, int64_t *saturations);

// Runs updates: inputs[updates][]. For each value: narrows low and high to its least and largest
// word (of states: before the update), with the update that first had it; counts saturations.
void @name@_observe(@name@_t *const self, const size_t updates, const int32_t *inputs,
    int32_t *const low, int32_t *const high, int64_t *const low_at, int64_t *const high_at,
    int64_t *const saturations) {
    const size_t values = @values@u;
    int32_t words[@values@ + 1];
    @name@_in_t row = {0};
    const @name@_in_t *const in = &row;
    (void) self;
    (void) in;
    (void) saturations;
    for (size_t k = 0u; k < updates; k++) {
        memcpy(&row, inputs, @macro@_INPUTS * sizeof *inputs);
        inputs += @macro@_INPUTS;
        @update@
        for (size_t v = 0u; v < values; v++) {
            if (words[v] < low[v]) {
                low[v] = words[v];
                low_at[v] = (int64_t) k;
            }
            if (words[v] > high[v]) {
                high[v] = words[v];
                high_at[v] = (int64_t) k;
            }
        }
    }
}
"""


def _filled(template: str, **texts: object) -> str:
    for key, text in texts.items():
        template = template.replace(f"@{key}@", str(text))
    return template


def host_source(name: str, states: int, *, number: str = "int32_t") -> str:
    """Text of ``<name>_host.c``, of a program or, with another ``number``, in floating point."""
    flags = "(out.saturated ? 1u : 0u) | (out.beyond ? 2u : 0u)" if number == "int32_t" else "0u"
    texts = {"name": name, "macro": name.upper(), "number": number, "states": states}
    return _filled(_HOST, **texts, flags=flags)


def observe_source(body: Body) -> str:
    """Text of ``<name>_observe.c``, which needs only ``<name>.h``."""

    def count(op: Op) -> Iterator[str]:
        if op.overflow is Overflow.SAT:
            yield f"saturations[{op.dest}] += saturated ? 1 : 0;"
            yield "saturated = false;"

    values = range(len(body.program.values))
    words = [f"words[{n}] = {body.word(n)};" for n in values]
    unused = ["(void) saturated;", "(void) beyond;"]
    update = "\n".join(body.statements(after=[*words, *unused], every_word=True, behind=count))
    return _filled(
        _OBSERVE,
        preamble="\n\n".join(filter(None, preamble(body, update))),
        update=update.replace("\n", "\n        "),
        name=body.name,
        macro=body.name.upper(),
        values=len(values),
    )
