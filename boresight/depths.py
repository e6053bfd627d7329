"""The depth of the pipeline that suits a target: that with the shortest time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from boresight.gateware.core import build_shared_core
from boresight.gateware.machine import ALL_CONFIGS, Machine, at_depth, machine_named
from boresight.gateware.schedule.slots import Schedule, ScheduleError
from boresight.gateware.synthesis.family import Target
from boresight.gateware.synthesis.targets import TARGETS
from boresight.sim.levels.build import Build


@dataclass(frozen=True)
class DepthChoice:
    """Depth of a core, chosen by time.

    Attributes
    ----------
    target : str
    config : str
        Configuration of that depth.
    depth : int
    us : mapping of int to float
        Time by depth [us].
    source : str
        Source of the clocks.
    """

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

    Parameters
    ----------
    make : callable
        The build of a configuration.
    config : str
        As typed. One whose name has a depth is taken as it is.
    target : str
        A part's name, or another word, for which no depth is chosen.
    """
    build = make(config.removesuffix("-d7"))
    if config not in ALL_CONFIGS or target not in TARGETS:
        return build, None
    choice = depth_by_time(build, TARGETS[target])
    return (build, None) if choice is None else (make(choice.config), choice)


def depth_by_time(build: Build, target: Target) -> DepthChoice | None:
    """The depth with the least time from the last input word to the last urgent output.

    Of several programs the longest time counts; of one without urgent outputs, its interval. One
    pass of the scheduler gives the cycles, the table of the family (`Family.clocks`) the clock.

    Parameters
    ----------
    build : Build
        Its configuration has no depth in its name.

    Returns
    -------
    DepthChoice or None
        None: the family has no clocks for such a machine, or none of its depths has room.
    """
    clocks = target.family.clocks
    lanes = machine_named(build.config).lanes
    configs = {d: at_depth(build.config, d) for d in Machine.DEPTHS if (lanes, d) in clocks}
    us = {}
    for depth, config in configs.items():
        try:
            core = build_shared_core(build.programs, config, urgents=build.urgents)
        except ScheduleError:
            continue
        us[depth] = max(_cycles(part.schedule) for part in core.parts) / clocks[lanes, depth]
    if not us:
        return None
    best = min(us, key=lambda depth: us[depth])
    return DepthChoice(target.name, configs[best], best, us, target.family.clocks_source)


def _cycles(schedule: Schedule) -> int:
    """Latency of the last urgent output; without one the interval."""
    return schedule.latency if schedule.urgent else schedule.interval
