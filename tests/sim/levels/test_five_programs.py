"""The programs of three systems in one core, in turns: RTL, C and interpreter give the same words.

In 512 registers of one lane they fit because results live in the registers of next states, and with
two lanes only 1,024 hold them.
"""

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.gateware.schedule.slots import ScheduleError
from boresight.model.resolve import estimator_of
from boresight.model.words.program import Kind
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import level_of, make_level

NAMES = ("satcom", "satcom_pointing", "mls_attitude", "array_phases", "registration")
SOAK = pytest.mark.soak


def records(build: Build, number: int, steps: int, rng: np.random.Generator) -> np.ndarray:
    """Inputs all over their ranges, and in runs where they hardly change."""
    low, high = np.array([(i.low, i.high) for i in build.estimators[number].inputs]).T
    u = rng.uniform(low, high, (steps, len(low)))
    u[steps // 3 : 2 * steps // 3] = u[steps // 3] * rng.uniform(0.99, 1.0, (1, len(low)))
    return u.clip(low, high)


@pytest.mark.parametrize(
    ("config", "steps"),
    [
        ("small", 12),
        *(pytest.param(c, 400, marks=SOAK) for c in ("small", "small-1024", "fast-1024")),
    ],
)
def test_in_turns(config: str, steps: int) -> None:
    rng = np.random.default_rng(4)
    build = Build(*map(estimator_of, NAMES), config=config, restarts=0)
    numbers = range(len(NAMES))
    given = [records(build, k, steps + k, rng) for k in numbers]
    runs = {
        name: level_of(name).run_together([make_level(name, build, k) for k in numbers], given)
        for name in ("fixed", "c", "rtl")
    }
    for k, wanted in enumerate(runs["fixed"]):
        for name in ("c", "rtl"):
            assert not runs[name][k].fault
            assert (runs[name][k].words == wanted.words).all(), (name, NAMES[k])
            assert (runs[name][k].saturated == wanted.saturated).all(), (name, NAMES[k])
        assert (runs["rtl"][k].interval_cycles == build.core.parts[k].schedule.interval).all()
    _rooms(build, crowded=config == "small")


def _rooms(build: Build, *, crowded: bool) -> None:
    """Whether results have gone to the registers of next states."""
    for part in build.core.parts:
        where = part.allocation.addresses()
        nexts = {where[after] for _, after in part.schedule.program.states}
        results = [n for n in where if part.schedule.program.values[n].kind is Kind.OP]
        guests = sum(where[n] in nexts for n in results) - len(nexts)
        assert (guests > 0) == (crowded and bool(nexts)), part.program.name


@SOAK
def test_two_lanes_need_more_registers() -> None:
    programs = Build(*map(estimator_of, NAMES), config="fast").programs
    wanted = r" states; config fast-1024 has more$"
    with pytest.raises(ScheduleError, match=wanted):
        build_shared_core(programs, "fast")
