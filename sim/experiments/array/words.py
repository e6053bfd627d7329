"""How long words must be: the strapdown alone, perfect sensors, with carried remainders or not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.firmware.build import CModel
from boresight.model.estimators.array.attitude import ArrayAttitude
from boresight.sim.attitude.zyx import wrapped
from boresight.sim.experiments.array.runs import ARCSEC
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import outputs_of
from boresight.sim.levels.stream import fed
from boresight.sim.worlds.array.world import ANGLES, TurningArray

__all__ = ["FORTY", "WORDS", "Plain", "Width", "run_width"]

FloatArray = npt.NDArray[np.float64]
WORDS = (24, 26, 28, 30, 32)
FORTY = (0.16, 0.43)  #: what a prototype with words of 40 bits measured in eight hours [arcsec].
_EVERY = 1000  #: samples between two that are looked at.


class Plain(ArrayAttitude):
    """`ArrayAttitude` without the remainders that it carries."""

    name = "array_plain"

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """See `ArrayAttitude`."""
        state, told = super().step(x, u, p)
        return state | {n: 0.0 * u.phase for n in state if n.startswith("rest_")}, told


@dataclass(frozen=True)
class Width:
    """Bits of a word, and of the counts that a perfect unit gives; at a rate, for some hours."""

    word: int
    deg_s: float
    hours: float


def run_width(width: Width, seeds: range) -> Runs:
    """Error of the worst angle [arcsec] while it turns: root mean square, most; of both forms."""
    world = TurningArray(
        width.deg_s, hours=width.hours, errors=0.0, plus=True, index="none", counts_bits=width.word
    )
    forms = {"carried": ArrayAttitude(aided=False), "plain": Plain(aided=False)}
    models = {n: CModel(e.compile(word=width.word)) for n, e in forms.items()}
    kept: dict[str, list[FloatArray]] = {n: [] for n in models}
    stream = fed(forms["plain"], world.pieces(truth=False))
    restart, done = next(stream), 0
    for model in models.values():
        model.update(words_of(model.program, restart))
    for inputs in stream:
        for name, model in models.items():
            words, _ = model.update(words_of(model.program, inputs))
            told = outputs_of(model.program, words[(-1 - done) % _EVERY :: _EVERY])
            kept[name].append(np.stack([told[n] for n in ANGLES], axis=1))
        done += len(inputs)
    truth = world.truth(0, world.samples, _EVERY) / np.pi
    figures = {}
    for name, found in kept.items():
        off = ARCSEC * wrapped(np.concatenate(found) - truth, 2.0)
        figures[f"{name}_rms"] = np.array([np.sqrt(np.mean(off**2, axis=0)).max()])
        figures[f"{name}_max"] = np.array([np.abs(off).max()])
    return Runs(figures)
