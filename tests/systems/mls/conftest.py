"""Runs and patterns of known figures, in place of flights."""

from collections.abc import Callable

import numpy as np
import pytest

from boresight.sim.experiments.seeds import Runs
from boresight.systems.mls.cases import Case
from boresight.systems.mls.deck import deck
from boresight.systems.mls.patterns import Trial
from boresight.systems.mls.runs import AZIMUTHS, Flight, figures_of


@pytest.fixture
def runs() -> Callable[[Case, float], Runs]:
    """One run of a case that is wrong by ``size`` [deg] all the time."""
    what = deck("table", 3.5, 1)

    def of(case: Case, size: float) -> Runs:
        own = {"norm": 1.0, "fixed_float_deg": 1e-4 * size, "fixed_float_rms_deg": 0.0}
        error = np.full((3500, 1, 3), size)
        values = {n: np.array([v]) for n, v in (own | {"saturated": 0.0}).items()}
        result = figures_of(Flight([what], error, what.q[:, None], values))
        scan = np.linspace(-62.0, 62.0, 50)
        for key in AZIMUTHS if case.steered else ():
            result.figures[f"beam_{key}_deg"] = np.array([0.05])
            result.figures[f"uncompensated_{key}_deg"] = np.array([5.0])
            result.shown["pulses"][key] = 2 * ((scan, 0.0 * scan),)
        return result

    return of


@pytest.fixture
def patterns() -> Callable[..., dict[str, Trial]]:
    """Stands in for `patterns_of`: the gain says how many elements, ``wrong`` how many draws."""

    def of(array, elevation: float, draws: int, seed: int) -> dict[str, Trial]:
        names = [f"{v}_0{b}_{k}" for v in "xyz" for b in (1, 5) for k in AZIMUTHS]
        figures = {"gain": array.elements / 64.0, "closed": 0.95, "peak": 1.0, "width": 1.59}
        figures |= {"sd": 0.0, "wrong": draws / 100.0, "sidelobe_db": -17.8}
        trial = Trial(figures, np.full(2481, 0.5))
        return dict.fromkeys([*names, "z_05_0_at_20", "z_05_0_at_30"], trial)

    return of
