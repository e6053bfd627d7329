"""The experiment: which case gives which figure, with short flights for long ones."""

import json

import numpy as np
import pytest

from boresight.sim.experiments.mls import experiment
from boresight.sim.experiments.mls.experiment import CASES, Mls, phases_fixed_float
from boresight.sim.experiments.mls.flights import Beams, Flight
from boresight.sim.experiments.mls.patterns import AZIMUTHS, Trial
from boresight.sim.worlds.mls_deck import deck

LIMITS = {"mls": {"small": 900, "fast": 670}, "phases64": {"small": 175, "fast": 115}}


def test_phases_fixed_float() -> None:
    assert 0.0 < phases_fixed_float(1, 500) < 2.0**-20


def test_run(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, steered = [], []
    what = deck("table", 3.5, 1)

    def flown(case, seeds):
        asked.append((case, len(seeds), seeds[0]))
        size = 0.1 * (1 + [*CASES.values()].index(case))
        error = np.full((3500, 1, 3), size)
        return Flight([what], error, what.q[:, None], np.ones(1), (1e-4 * size, 0.0), 0)

    def beams(flight, array, azimuth, elevation):
        steered.append((azimuth, elevation, array.elements))
        scan = np.linspace(-62.0, 62.0, 9)
        return Beams(np.full((1, 2), 0.05), np.full((1, 2), 5.0), 2 * ((scan, 0.0 * scan),))

    def patterns(array, elevation, draws, seed):
        names = [f"{v}_0{b}_{k}" for v in "xyz" for b in (1, 5) for k in AZIMUTHS]
        gain = array.elements / 64.0
        one = Trial(gain, gain, 1.0, 1.59, 0.0, draws / 100.0, -17.8, np.full(2481, 0.5))
        return dict.fromkeys([*names, "z_05_0_at_20", "z_05_0_at_30"], one)

    monkeypatch.setattr(experiment, "fly", flown)
    monkeypatch.setattr(experiment, "beam_errors", beams)
    monkeypatch.setattr(experiment, "patterns_of", patterns)
    monkeypatch.setattr(experiment, "render", lambda *given: repr([len(g) for g in given]))
    result = Mls().run(seed=5, runs=12, say=lambda text: None)
    assert [(c, n, s) for c, n, s in asked] == [
        (c, 12 if c.full else 10, 5) for c in CASES.values()
    ]
    assert steered == [(a, 3.0, 64) for a in AZIMUTHS.values()] * len(experiment.STEERED)
    f = result.figures
    assert f["mls_roll_deg"] == f["mls_corrected_roll_deg"] == pytest.approx(0.1)
    assert f["mls_prototype_heading_deg"] == pytest.approx(0.2)
    assert f["array16_x_01_0_gain"] == 0.25 and f["array64_x_01_0_wrong"] == 0.48
    assert f["mls_beam_m60_deg"] == 0.05 and f["mls_sea_5_uncompensated_0_deg"] == 5.0
    named = [*CASES].index("sea_5") + 1
    assert f["mls_fixed_float_deg"] == pytest.approx(1e-5 * named)
    assert "mls_bias_beam_0_deg" not in f and "mls_rolling_bias_beam_0_deg" in f
    for name, limits in LIMITS.items():
        for config, most in limits.items():
            assert 0 < f[f"{name}_interval_cycles_{config}"] <= most
    assert not any(t.good for t in result.targets if t.name.startswith("(18)"))
    json.dumps([dict(f), result.details], allow_nan=False)
    given = [len(CASES), len(CASES), len(CASES), len(AZIMUTHS), 2, len(result.targets)]
    assert result.pages["mls.html"] == repr(given)
