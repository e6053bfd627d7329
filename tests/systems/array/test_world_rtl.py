"""The core's Verilog on the array: words and saturations of the C around index, slew, alignment."""

import numpy as np
import pytest

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.records.reader import InputReader
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.world import ALIGNED, ERECTED, TurningArray


def same(world: TurningArray, config: str, parts: list[slice]) -> np.ndarray:
    """Run both on parts of a world's records; the status of each record."""
    build = Build(ArrayAttitude(), config=config)
    reader = InputReader(build.estimators[0], lambda *at: f"record {at}")
    records = np.concatenate([reader.take_rows(p)[0] for p in world.pieces()])
    some = np.concatenate([records[part] for part in parts])
    rtl, c = (make_level(name, build).run_anew(some) for name in ("rtl", "c"))
    np.testing.assert_array_equal(rtl.words, c.words)
    np.testing.assert_array_equal(rtl.saturated, c.saturated)
    assert rtl.fault == "" and rtl.interval_cycles is not None
    assert set(rtl.interval_cycles) == {build.core.schedule.interval}
    return c.outputs["status"].astype(int)


def test_index_slew_and_alignment() -> None:
    """Pieces of each, one after the other: each longer than a second."""
    world = TurningArray(36.0, hours=0.003, mark_deg=90.3)
    begins = (0, ALIGNED - 40, ERECTED - 40)
    status = same(world, "fast", [slice(k, k + 110) for k in begins])
    assert (status >> 6 & 1).sum() == 1 and {0, 1} <= set(status & 3)


@pytest.mark.soak
@pytest.mark.parametrize("config", ["small", "fast"])
@pytest.mark.parametrize("deg_s", [0.35, 36.0])
def test_ten_minutes(deg_s: float, config: str) -> None:
    """From the restart on; the mark passes in them at both rates."""
    world = TurningArray(deg_s, hours=287.0 / 3600.0, mark_deg=150.0, noise=1.0)
    status = same(world, config, [slice(None)])
    assert len(status) == 60_001 and (status >> 6 & 1).sum() == (1 if deg_s < 1.0 else 29)
