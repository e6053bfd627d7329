"""Lines with most operations: who takes a core's room."""

from __future__ import annotations

import re
from typing import Any

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output
from boresight.model.words.program import Overflow
from boresight.sim.levels.build import heaviest


class Uneven(Estimator):
    """Four functions on one line, one on another, none on the third."""

    inputs = (Input("a", 1.0, 2.0), Input("b", 1.0, 2.0))
    outputs = (Output("y"), Output("z"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Many."""
        many = sum(ops.sincos_ht(k * u.a)[0] for k in (0.3, 0.7, 1.1, 1.7))  # MANY
        few = 1.0 / u.b
        return {}, {"y": many, "z": few}


def test_lines_in_order_with_all_operations() -> None:
    program, nodes = Uneven().compile_traced()
    said = heaviest([(program, nodes)])
    (most, count), (_, less) = re.findall(r"(test_build\.py, line \d+) \((\d+)\)", said)
    watching = sum(op.overflow is Overflow.RANGE for op in program.ops)  # of no line
    assert watching == 2 and int(count) + int(less) == len(program.ops) - watching
    with open(__file__, encoding="utf-8") as source:
        (line,) = (k for k, text in enumerate(source, 1) if text.endswith("# MANY\n"))
    assert most == f"test_build.py, line {line}" and int(count) > 3 * int(less)
    assert said.startswith(f"; most of its {len(program.ops)} operations: {most} ({count}), ")
