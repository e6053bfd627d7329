"""Hold the method of the Spartan-6 clock estimate against routed clocks, on ECP5.

boresight calibrate --seeds 5  # hours: each design is routed with each seed
boresight calibrate --seeds 1 --designs 2  # a few minutes: the smallest two
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from boresight.arguments import check_number, check_routable
from boresight.core_files import route_core
from boresight.gateware.synthesis.calibration import Estimated, estimated
from boresight.gateware.synthesis.spartan6.delays import NET_MODELS
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.resolve import estimator_of as find_estimator
from boresight.options import Arguments, Outcome, Verb
from boresight.sim.answer import Answer
from boresight.sim.levels.build import Build

__all__ = ["Calibration", "calibrate"]

_TARGET: Final = "ecp5-25k"
_FOUR: Final = ("complementary", "ekf_quaternion", "ekf_bias", "mekf")
#: Estimators in one core, configuration, width of a word; those that are routed sooner first.
_DESIGNS: Final[tuple[tuple[tuple[str, ...], str, int], ...]] = (
    (("complementary",), "small-d9", 18),
    (("complementary",), "small", 32),
    (("mekf",), "small-d10", 24),
    (("pmsm",), "small-d9", 32),
    (("mekf",), "small-1024-d9", 32),
    (("vqf",), "small-d12", 32),
    (_FOUR, "small-d9", 32),
    (_FOUR, "small", 32),
    (_FOUR, "small-d10", 32),
    (_FOUR, "small-d12", 32),
    (("mekf",), "fast", 24),
    (_FOUR, "fast-d10", 32),
    (_FOUR, "fast-d9", 32),
    (_FOUR, "fast-d12", 32),
)


@dataclass(frozen=True)
class Calibration(Answer):
    """What `calibrate` gives.

    Attributes
    ----------
    designs : list of Estimated
    source : str
        What was routed.
    """

    designs: list[Estimated]
    source: str

    def band(self, nets: str) -> tuple[float, float]:
        """Least and greatest error with a net model, as a part of the routed clock."""
        errors = [design.errors[nets] for design in self.designs]
        return min(errors), max(errors)

    def __str__(self) -> str:
        lines = [f"{'design':32s} {'routed, MHz':>15s}" + "".join(f"{m:>18s}" for m in NET_MODELS)]
        for design in self.designs:
            routed = f"{min(design.routed_mhz):.1f} to {max(design.routed_mhz):.1f}"
            lines.append(
                f"{design.design:32s} {routed:>15s}"
                + "".join(
                    f"{design.estimates_mhz[m]:10.1f} {100 * design.errors[m]:+5.0f} %"
                    for m in NET_MODELS
                )
            )
        for nets in NET_MODELS:
            low, high = self.band(nets)
            lines.append(
                f"{nets} nets: {100 * low:+.0f} % to {100 * high:+.0f} % of the slowest seed"
            )
        return "\n".join([*lines, self.source])


def calibrate(
    *, seeds: int = 5, designs: int = len(_DESIGNS), progress: Callable[[str], None] | None = None
) -> Calibration:
    """Route designs on ECP5-25k, and estimate each with the nets of the others.

    An interrupted run continues: the build cache keeps each design as routed with each seed.

    Parameters
    ----------
    seeds : int
        Placements of each design; the slowest counts.
    designs : int
        How many of the designs, 2 or more, small ones first.

    Returns
    -------
    Calibration
        Routed clocks, estimates and their errors.
    """
    say = progress or (lambda text: None)
    check_number("seeds", seeds, 1, 1000)
    check_number("designs", designs, 2, len(_DESIGNS))
    check_routable([_TARGET], "install it, or leave this out")
    # All are scheduled before the first one is routed: what cannot be built shows at once.
    cores = {
        f"{'four filters' if names == _FOUR else names[0]}, {config}, W = {word}": Build(
            *map(find_estimator, names), config=config, word=word
        ).core
        for names, config, word in _DESIGNS[:designs]
    }
    routed = {
        title: route_core(core, TARGETS[_TARGET], seeds=seeds, progress=partial(_of, title, say))
        for title, core in cores.items()
    }
    (source, *_) = (design.source for design in routed.values())
    return Calibration(estimated(routed, "core"), source)


def _of(title: str, say: Callable[[str], None], text: str) -> None:
    """Say something of a design."""
    say(f"{title}: {text}")


def call(arguments: Arguments) -> Outcome:
    """Calibrate."""
    result = arguments.call(calibrate)
    return 0, result.to_json(), str(result)


VERB = Verb(calibrate, call=call)
