"""The cell: its charge from current and voltage, its world, its experiment."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.seeds import Runs
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.battery import world as cells
from boresight.systems.battery.estimator import DT, Battery, open_voltage
from boresight.systems.battery.experiment import Battery as Cells
from boresight.systems.battery.world import CHARGE_S, REST_S, STEPS, Discharge


def records(cell: str = "known", steps: int = STEPS) -> dict[str, Any]:
    (piece,) = Discharge(cell, (3,), steps).pieces()
    return {name: values[:, 0] for name, values in piece.items()}


@pytest.fixture(scope="module")
def drained() -> Runs:
    return Cells().run_case("known", range(1, 4))


def test_the_charge_is_known_soon_and_stays_so(drained: Runs) -> None:
    outcome = drained.pooled()
    assert outcome["known_s_max"] < 60.0 and outcome["charge_max"] < 0.005
    assert 0.95 < outcome["nis"] < 1.05
    assert outcome["fixed_float_max"] < 1e-4 and outcome["saturated_sum"] == 0.0


def test_an_offset_of_the_current_does_not_add_up() -> None:
    outcome = Cells().run_case("offset", range(1, 3)).pooled()
    assert outcome["charge_max"] < 0.01 < 0.04 < outcome["counted_max"]


def test_matched_resistances() -> None:
    plain, matched = (
        Cells().run_case(c, range(1, 2)).pooled()["charge_max"] for c in ("cold", "cold_told")
    )
    assert matched < 0.02 < 0.1 < plain


def test_the_standard_deviation_is_that_of_p() -> None:
    build = Build(Battery())
    with make_level("c", build) as level:
        loop = close_loop(Discharge("known", (3,), 500), level)
        ((at, _),) = [s for s in level.program.states if level.program.values[s[0]].name == "p_z_z"]
        k = [s for s, _ in level.program.states].index(at)
        assert loop.run.states is not None
        variance = level.program.format(at).real(loop.run.states[:, k])
    assert np.ravel(loop.outputs["sd_z"]) == pytest.approx(np.sqrt(variance), abs=1e-6)


def test_the_curve_is_the_published_one() -> None:
    z = np.linspace(0.05, 1.0, 40)
    assert np.asarray(open_voltage(z)) == pytest.approx(cells.open_voltage(z), abs=1e-12)
    assert cells.open_voltage(np.array([0.5, 1.0])) == pytest.approx([3.8033625, 4.1029], abs=1e-6)
    low = np.array([0.0, 0.05 - 1e-6, 0.05 + 1e-6])  # goes on straight
    slopes = np.diff(np.asarray(open_voltage(low))) / np.diff(low)
    assert slopes[0] == pytest.approx(slopes[1], rel=0.01)


def test_the_world_conserves_charge_and_relaxes() -> None:
    seen = records()
    drawn = np.diff(seen["z_true"]) * 3600.0 * 0.85
    current = np.round((seen["i"] - 0.0), 12)[1:]
    assert -drawn.sum() == pytest.approx(current.sum() * DT, abs=15.0)  # noise of 0.04 A
    begin, end = (round(t / DT) for t in REST_S)
    assert drawn[begin + 1 : end - 1] == pytest.approx(0.0, abs=1e-12)
    rest = seen["v_slow_true"][begin:end]
    tau = -(end - begin - 1) * DT / np.log(rest[-1] / rest[0])
    assert tau == pytest.approx(0.04984 * 4475.0, rel=0.02)
    assert (drawn[round(CHARGE_S / DT) :] > 0.0).all()


def test_an_unknown_cell_is_refused() -> None:
    with pytest.raises(InputError, match="cell: wanted one of known, aged.*found 'new'"):
        Discharge("new")
