"""Write an estimator as C99 in single or double precision, and run it on this computer.

The mathematics is that of the float reference, traced from `step` (`model.lowering.trace`), with
the functions of ``math.h``. Units and formats are those of the estimator's declarations: SI, angles
in half turns. The interface has the form of the integer C's.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import HostModel, compiled_library, host_source
from boresight.firmware.layout import banner, head, header, identifier, source
from boresight.model.estimator import Estimator
from boresight.model.lowering.trace import Condition, Trace
from boresight.model.ops import OPERATIONS
from boresight.model.tools.c_names import comment

#: Longest expression that is written where it is used.
_INLINE = 100
#: Numbers in the texts of `OPERATIONS`.
_NUMBERS = {"pi": math.pi, "turns": 1.0 / math.pi, "least": 1e-300}
#: Where the values of leaves are.
_GROUPS = {"input": "in->", "param": "self->params.", "state": "self->state."}

_HELPERS = """\
// x limited to [low, high]
static inline float clamp(const float x, const float low, const float high) {
    if (x < low) {
        return low;
    }
    return x > high ? high : x;
}

// The larger of two
static inline float larger(const float a, const float b) {
    return a < b ? b : a;
}

// The smaller of two
static inline float smaller(const float a, const float b) {
    return a < b ? a : b;
}

// -x where the condition holds
static inline float flipped(const bool condition, const float x) {
    return condition ? -x : x;
}

// x half turns wrapped to [-1, 1)
static inline float wrap_half_turns(const float x) {
    return x >= -1.0f && x < 1.0f ? x : x - 2.0f * floorf(0.5f * (x + 1.0f));
}

// x turns wrapped to [-1/2, 1/2)
static inline float wrap_turns(const float x) {
    return x >= -0.5f && x < 0.5f ? x : x - floorf(x + 0.5f);
}

// Angle of the vector (x, y) in rad; a negative zero x counts as zero
static inline float arc_tangent(const float y, const float x) {
    return atan2f(y, x + 0.0f);
}"""


def float_prefix(estimator: Estimator, *, single: bool = False) -> str:
    """Name of the files and prefix of every public name."""
    return f"{identifier(estimator.name)}_{'float' if single else 'double'}"


def _literal(number: float, single: bool) -> str:
    """The constant nearest to a number.

    One below every normal number, which guards a division, becomes the least of these.
    """
    kind = np.float32 if single else np.float64
    if 0.0 < abs(number) < np.finfo(kind).tiny:
        number = math.copysign(np.finfo(kind).tiny, number)
    return str(kind(number)) + "f" * single


def _statements(trace: Trace, single: bool) -> list[str]:
    """Variables, outputs, then next states.

    An expression that is used once is written there as long as it is short: a selection then
    computes one side alone.
    """
    plain: dict[int, int] = {}  # without names and ranges
    for e in trace.needed:
        passed = e.kind in ("named", "same", "bounded")
        plain[e.number] = plain[e.args[0].number] if passed else e.number
    written = [e for e in trace.needed if plain[e.number] == e.number]
    results = {f"out->{identifier(name)}": e for name, e in trace.outputs.items()}
    results |= {f"self->state.{identifier(s.data[1])}": e for s, _, e in trace.states}
    read = [*(arg for e in written for arg in e.args), *results.values()]
    uses = Counter(plain[e.number] for e in read)
    numbers = {name: _literal(number, single) for name, number in _NUMBERS.items()}
    texts: dict[int, str] = {}
    lines = []
    for e in written:
        if e.kind == "const":
            text = _literal(e.data[0], single)
        elif e.kind == "leaf":
            text = _GROUPS[e.data[0]] + identifier(e.data[1])
        else:
            args = [texts[plain[arg.number]] for arg in e.args]
            data = [_literal(number, single) for number in e.data]
            text = OPERATIONS[e.kind].c.format(*args, *data, **numbers)
        # States are read before they are written.
        long = uses[e.number] > 1 or len(text) > _INLINE
        if e.kind == "leaf" or (long and e.kind != "const"):
            kind = "bool" if isinstance(e, Condition) else "float"
            lines.append(f"const {kind} t{e.number} = {text};")
            text = f"t{e.number}"
        texts[e.number] = text
    return lines + [f"{place} = {texts[plain[e.number]]};" for place, e in results.items()]


def emit_float_c(estimator: Estimator, *, single: bool = False) -> dict[str, str]:
    """Texts of ``<name>_double.h`` and ``<name>_double.c`` (or ``_float``) by file name.

    Raises InputError if ``step`` raises, or does not return the states and outputs.
    """
    e, name = estimator, float_prefix(estimator, single=single)
    origin = f'Generated from the estimator "{comment(e.name)}"; do not edit.'
    brief = f"{'Single' if single else 'Double'}-precision estimator."
    declared: dict[str, Sequence[Any]] = {"params": e.params, "state": e.states}
    declared |= {"in": e.inputs, "out": e.outputs}
    files = {
        f"{name}.h": header(
            name,
            head(f"{name}.h", brief, origin),
            definitions=f"#define {name.upper()}_INPUTS {len(e.inputs)}\n"
            f"#define {name.upper()}_OUTPUTS {len(e.outputs)}",
            members={k: [f"float {identifier(d.name)};" for d in v] for k, v in declared.items()},
            number="float",
            words="",
            start="start values",
        ),
        f"{name}.c": source(
            name,
            head(f"{name}.c", brief, origin),
            before=["#include <math.h>", banner("Functions"), _HELPERS],
            params=[
                f"self->params.{identifier(p.name)} = {_literal(p.default, single)};"
                for p in e.params
            ],
            states=[
                f"self->state.{identifier(s.name)} = {_literal(s.initial, single)};"
                for s in e.states
            ],
            update=_statements(e.record(), single),
        ),
    }
    if single:
        return files
    # The functions of double precision; what has an f is exact in both.
    texts = {file: re.sub(r"\bfloat\b", "double", text) for file, text in files.items()}
    return {file: re.sub(r"(\w)f\(", r"\1(", text) for file, text in texts.items()}


class FloatCModel(HostModel):
    """The emitted C of an estimator: the float64 reference, compiled, or in ``single`` precision.

    ``params`` are parameter values, by default those declared.
    """

    def __init__(
        self,
        estimator: Estimator,
        *,
        single: bool = False,
        params: Mapping[str, float] | None = None,
    ) -> None:
        self.estimator = estimator
        name, states = float_prefix(estimator, single=single), len(estimator.states)
        host = host_source(name, states, number="float" if single else "double")
        files = {**emit_float_c(estimator, single=single), f"{name}_host.c": host}
        library = compiled_library(files, libraries=("-lm",))
        number = np.float32 if single else np.float64
        super().__init__(library, number, len(estimator.params), states)
        self.set_params(params)

    def set_params(self, params: Mapping[str, float] | None) -> None:
        """Set these parameter values, and the others to their defaults."""
        self.params[:] = list(self.estimator.param_values(params).values())

    def update(self, inputs: npt.ArrayLike) -> npt.NDArray[np.floating[Any]]:
        """Run n updates: inputs (n, n_inputs) in their units -> outputs (n, n_outputs).

        Raises ValueError for a wrong shape.
        """
        records = self.records(inputs, len(self.estimator.inputs))
        return self.run(records[:, None], len(self.estimator.outputs))[0][:, 0]
