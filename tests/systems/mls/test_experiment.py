"""The experiment: which case gives which figure, target and verdict, with stand-ins for flights."""

import json

import pytest

from boresight.sim.experiments.experiment import Result, Target
from boresight.sim.experiments.targets import targets_of
from boresight.systems.mls import experiment
from boresight.systems.mls.cases import CASES
from boresight.systems.mls.experiment import Mls, phases_fixed_float
from boresight.systems.mls.runs import AZIMUTHS, flown

LIMITS = {"mls": {"small": 900, "fast": 670}, "phases64": {"small": 175, "fast": 115}}
GOOD = {
    **{"mls_corrected_roll_deg": 0.126, "mls_prototype_roll_deg": 0.128},
    **{"mls_gyro_only_roll_deg": 0.5, "mls_rolling_beam_0_deg": 0.1},
    **{"mls_rolling_beam_60_deg": 0.3, "array64_x_01_0_gain": 0.95, "array64_x_05_0_gain": 0.31},
    **{"array64_x_01_0_width": 1.59, "array64_y_01_0_width": 1.59},
    **{"array64_y_05_0_sidelobe_db": -17.8, "array64_z_05_0_sidelobe_db": -17.5},
    **{"array64_z_05_0_at_30_sidelobe_db": -11.0, "mls_sea_5_uncompensated_0_deg": 0.02},
    **{"mls_sea_5_beam_0_deg": 0.06},
}


def test_phases_fixed_float() -> None:
    assert 0.0 < phases_fixed_float(1, 500) < 2.0**-20


@pytest.fixture
def result(monkeypatch, runs, patterns) -> Result:
    """Every case wrong by 0.1 deg more than the one before."""

    def run_cases(run, cases, *, seed, at_once, jobs, say):
        assert (run, seed, jobs) == (flown, 5, 1)
        few = {name: 12 if case.full else 10 for name, case in CASES.items()}
        assert [(n, some) for n, _, some in cases] == [*few.items()]
        return {name: runs(case, 0.1 * (1 + k)) for k, (name, case, _) in enumerate(cases)}

    monkeypatch.setattr(experiment, "run_cases", run_cases)
    monkeypatch.setattr(experiment, "patterns_of", patterns)
    return Mls(jobs=1).run(seed=5, runs=12, say=lambda text: None)


def test_run(result: Result) -> None:
    f = result.figures
    assert f["mls_roll_deg"] == f["mls_corrected_roll_deg"] == pytest.approx(0.1)
    assert f["mls_prototype_heading_deg"] == f["mls_prototype_worst_deg"] == pytest.approx(0.2)
    assert f["array16_x_01_0_gain"] == 0.25 and f["array64_x_01_0_wrong"] == 0.48
    assert f["mls_beam_m60_deg"] == 0.05 and f["mls_sea_5_uncompensated_0_deg"] == 5.0
    named = [*CASES].index("sea_5") + 1
    assert f["mls_fixed_float_deg"] == pytest.approx(1e-5 * named)
    steered = [name for name in CASES if f"mls_{name}_beam_0_deg" in f]
    assert steered == ["rolling", "rolling_bias", "sea_5", "sea_6"]
    for name, limits in LIMITS.items():
        for config, most in limits.items():
            assert 0 < f[f"{name}_interval_cycles_{config}"] <= most
    assert len(result.targets) == 45
    assert not any(t.good for t in result.targets if t.source in ("(18)", "(24)"))
    spread = {t.name: t.spread for t in result.targets}["peak error, jumps of 8 deg, deg"]
    assert spread == pytest.approx((0.1, 0.1))
    json.dumps([dict(f), result.details], allow_nan=False)
    page = result.pages["mls.html"]
    assert page.count('class="bad"') == sum(not t.good for t in result.targets)


def verdicts(result: Result, given: dict[str, float]) -> dict[str, Target]:
    """By name; figures that are not given are 1."""
    figures = dict.fromkeys(result.figures, 1.0) | given
    return {t.name: t for t in targets_of("boresight.systems.mls", figures)}


def test_verdicts(result: Result) -> None:
    found = verdicts(result, GOOD)
    assert found["X, b = 0.1: usable at 0, gain"].good
    assert found["beam at 0, compensated, rms, deg"].good
    assert not found["beam at 60, compensated, rms, deg"].good
    ratio = found["roll, rms, over prototype's, same runs"]
    assert ratio.good and ratio.binding and ratio.value == 0.126 / 0.128
    assert found["roll: gyro alone worse, times"].value == 0.5 / 0.126
    assert found["roll, rms, deg"].good and found["roll, rms, deg"].binding
    phases = found["phases, the same, turns"]
    assert phases.high == 2.0**-20 and not phases.good


def test_what_is_claimed_and_not_true_has_a_reason_and_does_not_bind(result: Result) -> None:
    found = verdicts(result, GOOD)
    broad = found["X, b = 0.1 broadens the pulse, times"]
    assert broad.value == 1.0 and not broad.good and not broad.binding and broad.note
    low = found["Z, b = 0.5 raises side lobes at 3 deg, dB"]
    assert low.value == pytest.approx(0.3) and not low.good
    assert found["the same at 30 deg, dB"].good
    restored = found["compensation restores pulses of (14), gain"]
    assert restored.value == 0.31 and not restored.good
    assert abs(found["carrier, sea state 5: beam better, times"].value - 1 / 3) < 1e-9


def test_all_that_binds_has_a_limit(result: Result) -> None:
    for target in result.targets:
        assert target.low is not None or target.high is not None
    reported = [t for t in result.targets if not t.binding]
    assert len(reported) == 4 and all(
        t.note and t.source not in ("ours", "prototype") for t in reported
    )
    for axis, said in (("roll", 0.126), ("pitch", 0.143), ("heading", 0.062)):
        own = next(t for t in result.targets if t.name == f"{axis}, rms, deg")
        assert (own.low, own.high) == pytest.approx((0.95 * said, 1.05 * said))
    assert set(AZIMUTHS) == {"m60", "0", "60"}
