"""The depth of the pipeline that suits a target: that with the shortest time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from boresight.gateware.core import build_shared_core
from boresight.gateware.machine import ALL_CONFIGS, Machine, at_depth, machine_named
from boresight.gateware.schedule.slots import ScheduleError
from boresight.gateware.synthesis.targets import TARGETS
from boresight.sim.levels.build import Build


@dataclass(frozen=True)
class DepthChoice:
    """Depth of a core, chosen by time: of each depth [us], from clocks of ``source``."""

    target: str
    config: str
    depth: int
    us: Mapping[int, float]
    source: str

    def __str__(self) -> str:
        others = ", ".join(f"{d} {t:.3g}" for d, t in self.us.items() if d != self.depth)
        return (
            f"depth {self.depth} for {self.target} ({self.config}): {self.us[self.depth]:.3g} us "
            f"to the last urgent output{f' ({others})' if others else ''} by one pass of the "
            f"scheduler and {self.source}"
        )


def build_for(
    make: Callable[[str], Build], config: str, target: str
) -> tuple[Build, DepthChoice | None]:
    """The build for a target, and the choice of its depth: the machine that every verb takes.

    The depth is that with the least time from the last input word to the last urgent output. Of
    several programs the longest time counts; of one without urgent outputs, its interval. One pass
    of the scheduler gives the cycles, the table of the family (`Family.clocks`) the clock.

    Parameters
    ----------
    make : callable
        The build of a configuration.
    config : str
        As typed. One whose name has a depth is taken as it is.
    target : str
        A part's name. For another word, and a family without clocks, no depth is chosen.
    """
    build = make(config.removesuffix("-d7"))
    if config not in ALL_CONFIGS or target not in TARGETS:
        return build, None
    family, lanes = TARGETS[target].family, machine_named(build.config).lanes
    configs = {d: at_depth(config, d) for d in Machine.DEPTHS if (lanes, d) in family.clocks}
    us = {}
    for depth, name in configs.items():
        try:
            core = build_shared_core(build.programs, name, urgents=build.urgents)
        except ScheduleError:  # no room
            continue
        plans = [part.schedule for part in core.parts]
        cycles = max(plan.latency if plan.urgent else plan.interval for plan in plans)
        us[depth] = cycles / family.clocks[lanes, depth]
    if not us:
        return build, None
    best = min(us, key=lambda depth: us[depth])
    choice = DepthChoice(target, configs[best], best, us, family.clocks_source)
    return make(choice.config), choice
