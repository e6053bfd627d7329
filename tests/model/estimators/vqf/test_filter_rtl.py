"""VQF in Verilog is the integer model at every hostile update, in both configurations."""

from __future__ import annotations

import numpy as np
import pytest

import boresight
from boresight.model.estimators.vqf import Vqf
from boresight.sim.accuracy.manoeuvres import MANOEUVRES, manoeuvre
from tests.support.vqf_package import COLUMNS, inputs_of


@pytest.mark.soak
@pytest.mark.parametrize("mag", ["full", "none"])
@pytest.mark.parametrize("config", ["small", "fast"])
def test_hostile_updates(config: str, mag: str) -> None:
    made, rng = Vqf(200.0, mag=mag), np.random.default_rng(5)
    motions = [manoeuvre(n, 2400, rng) for n in MANOEUVRES if n != "uneven"]
    drawn = np.stack([rng.uniform(i.low, i.high, 1000) for i in Vqf.inputs], axis=1)
    drawn[:, 0] = np.where(rng.random(1000) < 0.02, -0.1, 0.005)
    records = inputs_of(made, np.concatenate([*motions, drawn]))
    assert [i.name for i in Vqf.inputs] == list(COLUMNS)
    columns = {i.name: records[:, k] for k, i in enumerate(made.inputs)}
    (result,) = boresight.check(made, columns, config=config)
    for level in result.levels:
        assert level.n_mismatch == 0 and level.n_total > 0 and not level.error, level
        assert level.cycles_predicted == level.cycles_max == level.cycles_min, level
        assert level.interval_predicted == level.interval_max, level
    assert {level.level for level in result.levels} == {"fixed", "c", "rtl"}
