"""One minute and a bit of some cases, flown once for all tests of the experiment."""

import dataclasses

import pytest

from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.satcom.cases import CASES, Case
from boresight.systems.satcom.drive import Drive
from boresight.systems.satcom.estimator import Satcom as Filter
from boresight.systems.satcom.runs import figures_of
from boresight.systems.satcom.world import Vehicles

SECONDS = 70.0


def shortened(case: Case, seeds: range, seconds: float = SECONDS) -> Vehicles:
    """The vehicles of a case on the beginning of its drive."""
    fleet = case.fleet(seeds)
    whole, n = fleet.drive, round(seconds * case.rate_hz)
    arrays = ("euler", "q", "rate", "acceleration", "force")
    ride = dataclasses.replace(whole.ride, **{a: getattr(whole.ride, a)[:n] for a in arrays})
    return dataclasses.replace(fleet, drive=Drive(ride, whole.loss_db[:n]), losses_db=[])


def flown(name: str, seeds: range) -> tuple[Vehicles, Loop]:
    case = CASES[name]
    fleet = shortened(case, seeds)
    build = Build(Filter(**case.options), params=[case.params])
    return fleet, close_loop(fleet, make_level("c", build, runs=fleet.runs))


@pytest.fixture(scope="session")
def adaptive() -> tuple[Vehicles, Loop]:
    return flown("adaptive", range(1, 3))


@pytest.fixture(scope="session")
def runs(adaptive: tuple[Vehicles, Loop]) -> dict[str, Runs]:
    """Figures by case: accelerations before and after half a minute."""
    results = {"adaptive": figures_of(CASES["adaptive"], *adaptive)}
    for name in ("fixed_r", "printed_roll", "declared"):
        results[name] = figures_of(CASES[name], *flown(name, range(1, 3)))
    return results
