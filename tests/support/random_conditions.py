"""Random expressions of conditions and numbers, with every operator that Python has for them."""

from __future__ import annotations

import math
import random
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State

#: Numbers; of each factor or term four quarters, so that words hold what float64 holds.
_LEAVES = (*("u.a", "u.b", "x.s", "p.k", "p.m") * 2, "0.25", "-0.5", "1")
_NUMBERS = {
    "{N} + {N}": 6,
    "{N} - {N}": 6,
    "{N} * {N}": 6,
    "-{N}": 2,
    "+{N}": 1,
    "abs({N})": 2,
    "{N}**2": 1,
    "{N} / 2": 2,
    "ops.where({C}, {N}, {N})": 14,
    "ops.flip({C}, {N})": 6,
    "ops.maximum({N}, {N})": 2,
    "ops.clip({N}, -0.5, 0.75)": 2,
}
_CONDITIONS = {
    **{f"{{N}} {sign} {{N}}": 3 for sign in ("<", ">", "<=", ">=")},
    **{f"{{C}} {sign} {{C}}": 6 for sign in ("&", "|", "^", "==", "!=")},
    "~{C}": 6,
    **dict.fromkeys(("True", "False", "np.True_", "np.False_"), 1),
    "np.logical_xor({C}, {C})": 2,
    "np.logical_not({C})": 1,
}
#: What Python takes and a record may not: each is refused, or means the same.
_NUMBERS_ODD = (
    *("{N} // {N}", "{N} % {N}", "divmod({N}, {N})[0]", "round({N})", "int({N})", "float({N})"),
    *("{N} ** {N}", "2**{N}", "max({N}, {N})", "min({N}, {N})", "sorted([{N}, {N}])[0]"),
    *("{N} if {C} else {N}", "{N} & {N}", "~{N}", "{N} << 1", "{N} @ {N}", "math.floor({N})"),
    *("{C} + {N}", "{N} * {C}", "-{C}", "+{C}", "abs({C})", "float({C})", "[{N}, {N}][{C}]"),
    *("sum([{C}, {C}])", "{C} - {C}", "{C} / {C}", "{C} * {C}", "{C} ** {C}", "{C} // {C}"),
    *("np.maximum({N}, {N})", "np.where({C}, {N}, {N})", "math.copysign({N}, {N})", "{C} or {N}"),
    *("{N} ^ {N}", "complex({N}).real", "np.hypot({N}, {N})", "1 / {N}", "{C} << {C}", "{C} @ {C}"),
)
_CONDITIONS_ODD = (
    *("{C} in ({C}, {C})", "{C} not in [{C}]", "{C} is {C}", "{C} is not {C}", "{C} is True"),
    *("not {C}", "{C} and {C}", "{C} or {C}", "{C} < {C}", "{C} >= {C}", "{N} < {N} < {N}"),
    *("{N} == {N}", "{N} != {N}", "bool({C})", "bool({N})", "hash({C}) == hash({C})", "{N} & {C}"),
    *("{C} == {C} == {C}", "{C} == 1", "{C} == {N}", "{N} in ({N}, {N})", "{C} & 1", "{C} | {N}"),
    *("any([{C}, {C}])", "all([{C}])", "{C} in {{{C}: 1}}", "isinstance({N}, float)"),
    *("{N} is {N}", "np.equal({C}, {C})", "{C} ^ 1", "~bool({N})", "[{C}] == [{C}]"),
    *("len({{{C}, {C}}}) == 1", "len({{{N}, {N}}}) == 1", "{C} if {C} else {C}", "int({C}) == 1"),
)


@dataclass(frozen=True)
class Text:
    """An expression of x, u and p, a number."""

    text: str

    @property
    def function(self) -> Callable[[Any, Any, Any], Any]:
        """What computes it."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "is" with a literal
            code = compile(f"lambda x, u, p: {self.text}", "random_text.py", "eval")
        function: Callable[[Any, Any, Any], Any] = eval(code, {"ops": ops, "np": np, "math": math})
        return function


def random_text(seed: int, *, depth: int = 5, odd: float = 0.04) -> Text:
    """A random expression; a share ``odd`` of its parts is what a record may not show."""
    rng = random.Random(seed)

    def make(kind: str, left: int) -> str:
        if kind == "N" and (left <= 0 or rng.random() < 0.15):
            return rng.choice(_LEAVES)
        if kind == "C" and left <= 1:
            forms: Sequence[str] = ["{N} < {N}", "{N} >= {N}"]
        elif rng.random() < odd:
            forms = _NUMBERS_ODD if kind == "N" else _CONDITIONS_ODD
        else:
            table = _NUMBERS if kind == "N" else _CONDITIONS
            forms = rng.choices([*table], [*table.values()])
        form, parts = rng.choice(forms).replace("{{", "{").replace("}}", "}"), set[str]()
        for part in ("N", "C"):
            while f"{{{part}}}" in form:
                text = make(part, left - 1)
                while text in parts:  # x < x: within rounding it may be either
                    text = make(part, left)
                parts.add(text)
                form = form.replace(f"{{{part}}}", f"({text})", 1)
        return form

    return Text(make("N", depth))


class Conditional(Estimator):
    """Outputs that are random expressions; the state is the last input."""

    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    params = (Param("k", 0.25, -1.0, 1.0), Param("m", -0.5, -1.0, 1.0))
    states = (State("s", -1.0, 1.0),)

    def __init__(self, *texts: Text) -> None:
        self.functions = [text.function for text in texts]
        self.outputs = tuple(Output(f"y{k}") for k in range(len(texts)))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Each expression."""
        return {"s": u.a}, {f"y{k}": f(x, u, p) for k, f in enumerate(self.functions)}
