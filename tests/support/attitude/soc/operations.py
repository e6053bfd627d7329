"""What a single-precision operation costs on the soft core, and what an update should cost by that.

The sum of counted operations leaves out what is not float arithmetic: loads, stores, branches, and
the instruction cache, which is cold where a program is longer than it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from boresight.firmware.attitude.image import build_image
from boresight.gateware.attitude.soc.layout import soc_header
from boresight.sim.attitude.soc.measure import RAM, soc_bench

#: Operations in the order of operations.c, behind the empty loop.
_NAMES = ("add", "sub", "mul", "div", "less", "sqrt", "sin", "cos", "asin", "atan2")
_REPEAT = 16


def operation_cycles(*, optimise: str = "-Os") -> dict[str, float]:
    """Mean cycles of each operation, loads and stores of its operands not counted."""
    image = build_image(
        {
            "operations.c": Path(__file__).with_name("operations.c").read_text(),
            "soc_registers.h": soc_header(),
        },
        sources=("operations.c",),
        ram=RAM,
        optimise=optimise,
    )
    run = soc_bench(ram=RAM).run({}, max_cycles=5_000_000, files={"firmware.hex": image.hex})
    words = [int(line.split()[1], 16) for line in run.stdout.splitlines() if line[:2] == "O "]
    empty, *rest = words
    costs = {name: (word - empty) / _REPEAT for name, word in zip(_NAMES, rest, strict=True)}
    # The operand of the arc tangent is a difference.
    costs["atan2"] -= costs["sub"]
    return costs


#: What an operation consists of that is not itself measured, or of more than itself. A limit is two
#: comparisons, as is a wrap (its common case).
_PARTS = {
    "sin": ("sin", "mul"),
    "cos": ("cos", "mul"),
    "asin": ("asin", "mul", "less", "less"),
    "atan2": ("atan2", "add", "mul", "less", "less"),
    "rsqrt": ("sqrt", "div", "less"),
    "clip": ("less", "less"),
    "saturated": ("less", "less"),
    "wrap": ("less", "less"),
    "larger": ("less",),
    "smaller": ("less",),
}


def counted_cycles(operations: Mapping[str, int], costs: Mapping[str, float]) -> float:
    """Cycles of so many operations (`firmware.floating.text.operation_counts`).

    Changes of sign, selections and logic are a few instructions each and count as nothing.
    """
    return sum(
        n * costs[part]
        for kind, n in operations.items()
        for part in _PARTS.get(kind, (kind,) if kind in costs else ())
    )
