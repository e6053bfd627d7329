"""How long words must be: the strapdown alone, perfect sensors, with carried remainders or not."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.runs import turned
from boresight.systems.array.world import TurningArray

WORDS = (24, 28, 32)
FORTY = (0.16, 0.43)  #: what a prototype with words of 40 bits had after eight hours [arcsec].


class Plain(ArrayAttitude):
    """`ArrayAttitude` without the remainders that it carries."""

    name = "array_plain"

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        state, outputs = super().step(x, u, p)
        return state | {n: 0.0 * u.phase for n in state if n.startswith("rest_")}, outputs


def run_width(width: tuple[int, float, float], seeds: range) -> Runs:
    """Error of the worst angle [arcsec] while it turns, root mean square, of both forms.

    ``width``: bits of words, and of the counts of a perfect unit; its rate [deg/s]; hours.
    """
    word, deg_s, hours = width
    exact: dict[str, Any] = {"errors": 0.0, "plus": True, "index": "none", "truths": False}
    world = TurningArray(deg_s, hours=hours, counts_bits=word, **exact)
    figures = {}
    for name, form in (("carried", ArrayAttitude), ("plain", Plain)):
        run = turned(world, Build(form(aided=False), word=word))
        square = np.mean(run.error**2, axis=0)
        figures[f"{name}_rms"] = np.array([np.sqrt(square.max())])
    return Runs(figures)
