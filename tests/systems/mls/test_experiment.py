"""The landing system's experiment: cases, figures, page."""

import json
import math

import numpy as np
import pytest

from boresight.sim.experiments.experiment import Result, Target
from boresight.sim.experiments.targets import targets_of
from boresight.systems.mls import experiment
from boresight.systems.mls.cases import CASES, Case
from boresight.systems.mls.deck import MOTIONS, SensorErrors, deck
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.experiment import Mls, phases_fixed_float
from boresight.systems.mls.linear_array import Array, direction
from boresight.systems.mls.page import render
from boresight.systems.mls.runs import (
    AXES,
    AZIMUTHS,
    SETTLED,
    Flight,
    beam_errors,
    figures_of,
    flown,
    fly,
    phases_of,
    pooled,
)

# --------------------------------------------------------------------------------------------------
# the experiment: which case gives which figure, target and verdict, with stand-ins for flights

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


def test_of_two_runs_as_many_patterns_are_drawn_as_of_ten(monkeypatch) -> None:
    """Of fewer, all pulses may be at a wrong place, and there is nothing to take a mean of."""

    class Drawn(Exception):
        pass

    def patterns_of(array: Array, elevation_deg: float, draws: int, seed: int) -> None:
        raise Drawn(draws)

    monkeypatch.setattr(experiment, "patterns_of", patterns_of)
    with pytest.raises(Drawn, match="^40$"):
        Mls(jobs=1).run(seed=5, runs=2, say=lambda text: None)


def verdicts(result: Result, values: dict[str, float]) -> dict[str, Target]:
    """By name; figures that are not given are 1."""
    figures = dict.fromkeys(result.figures, 1.0) | values
    return {t.name: t for t in targets_of("boresight.systems.mls", figures)}


def test_verdicts(result: Result) -> None:
    outcome = verdicts(result, GOOD)
    assert outcome["X, b = 0.1: usable at 0, gain"].good
    assert outcome["beam at 0, compensated, rms, deg"].good
    assert not outcome["beam at 60, compensated, rms, deg"].good
    ratio = outcome["roll, rms, over prototype's, same runs"]
    assert ratio.good and ratio.binding and ratio.value == 0.126 / 0.128
    assert outcome["roll: gyro alone worse, times"].value == 0.5 / 0.126
    assert outcome["roll, rms, deg"].good and outcome["roll, rms, deg"].binding
    phases = outcome["phases, the same, turns"]
    assert phases.high == 2.0**-20 and not phases.good


def test_what_is_claimed_and_not_true_has_a_reason_and_does_not_bind(result: Result) -> None:
    outcome = verdicts(result, GOOD)
    broad = outcome["X, b = 0.1 broadens the pulse, times"]
    assert broad.value == 1.0 and not broad.good and not broad.binding and broad.note
    low = outcome["Z, b = 0.5 raises side lobes at 3 deg, dB"]
    assert low.value == pytest.approx(0.3) and not low.good
    assert outcome["the same at 30 deg, dB"].good
    restored = outcome["compensation restores pulses of (14), gain"]
    assert restored.value == 0.31 and not restored.good
    assert abs(outcome["carrier, sea state 5: beam better, times"].value - 1 / 3) < 1e-9


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


# -- flights of known errors, and what a core that knows its attitude does to the beam ------------


def known(error: np.ndarray, motion: str = "table") -> Flight:
    """A flight that told the truth but for errors (n, runs, 3) [deg]."""
    seconds = len(error) / 1000.0
    decks = [deck(motion, seconds, seed) for seed in range(1, error.shape[1] + 1)]
    q = np.stack([d.q for d in decks], axis=1)
    n = len(decks)
    own = {"norm": np.linspace(0.8, 1.0, n), "fixed_float_deg": np.linspace(0.1, 0.25, n)}
    own |= {"fixed_float_rms_deg": np.full(n, 0.125), "saturated": np.full(n, 3.0)}
    return Flight(decks, error, q, own)


def flight_figures(flight: Flight) -> dict[str, float]:
    return pooled(figures_of(flight))


def test_figures_of_known_errors() -> None:
    error = np.zeros((4200, 2, 3))
    error[:SETTLED] = 50.0
    error[SETTLED:, 0], error[SETTLED:, 1] = [1.0, -2.0, 0.0], [1.0, 2.0, 3.0]
    outcome = flight_figures(known(error))
    assert [outcome[f"{a}_deg"] for a in AXES] == pytest.approx([1.0, 2.0, 3.0 / math.sqrt(2.0)])
    assert (outcome["worst_deg"], outcome["max_deg"]) == pytest.approx((3.0 / math.sqrt(2.0), 3.0))
    assert outcome["norm"] == pytest.approx(0.9) and outcome["saturated"] == 6.0
    assert (outcome["fixed_float_deg"], outcome["fixed_float_rms_deg"]) == (0.25, 0.125)
    encoder = flight_figures(known(np.zeros((4200, 1, 3))))["encoder_deg"]
    assert encoder == pytest.approx(360.0 / 4096.0 / math.sqrt(12.0), rel=0.05)


@pytest.mark.parametrize("lag", [0, 7])
def test_lag_of_a_delayed_answer(lag: int) -> None:
    truth = np.degrees(deck("table", 4.2, 1).euler)
    error = np.zeros((4200, 1, 3))
    error[lag:, 0] = truth[: 4200 - lag] - truth[lag:] + 0.3
    assert flight_figures(known(error))["lag_ms"] == lag


def test_the_lag_is_that_of_all_runs_together() -> None:
    """A run whose own lag is another one does not count alone."""
    runs = figures_of(known(np.zeros((4200, 1, 3))))
    runs.each[:] = [np.full((20, 3), 5.0) for _ in range(2)]
    runs.each[0][7], runs.each[1][2] = 1.0, 4.0
    assert pooled(runs)["lag_ms"] == 7.0


def test_beams_of_a_case() -> None:
    """Root mean square of each run, by azimuth; shown is the first run."""
    flight = known(np.zeros((3400, 2, 3)), "rolling")
    runs = figures_of(flight, steered=True)
    after, before, shown = beam_errors(flight, Array(), -60.0, 3.0)
    assert runs.figures["beam_m60_deg"] == pytest.approx(np.sqrt(np.mean(after**2, axis=1)))
    wanted = np.sqrt(np.mean(before**2))
    assert pooled(runs)["uncompensated_m60_deg"] == pytest.approx(wanted)
    assert list(runs.shown["pulses"]) == ["m60", "0", "60"]
    assert (runs.shown["pulses"]["m60"][1][1] == shown[1][1]).all()
    assert not any(name.startswith("beam") for name in figures_of(flight).figures)


def test_a_core_and_its_references() -> None:
    """The integer program and the dense filter agree within 5 %; the gyro alone drifts."""
    cases = (Case("core"), Case("dense", reference="prototype"), Case("gyro", reference="gyro"))
    core, dense, gyro = (flight_figures(fly(c, (3, 4), 3.6)) for c in cases)
    for axis in AXES:
        assert core[f"{axis}_deg"] == pytest.approx(dense[f"{axis}_deg"], rel=0.05)
    assert gyro["worst_deg"] > 0.2 and core["saturated"] == 0.0
    assert 0.0 < core["fixed_float_deg"] < 1e-3 and dense["fixed_float_deg"] == 0.0
    late = flight_figures(fly(Case("late", errors=SensorErrors(gyro_lag=5)), (3,), 3.6))
    assert late["lag_ms"] == 5.0


def test_phases_are_those_of_the_program() -> None:
    array = Array(16, 0.7)
    beams = direction([-30.0, 0.0, 50.0], 3.0)
    outcome = phases_of(array, np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), beams)
    wanted = 0.7 * beams[:, 1:2] * np.arange(16)
    assert np.abs((outcome - wanted + 0.5) % 1.0 - 0.5).max() < 1e-6


def test_a_known_attitude_leaves_no_error_of_the_beam() -> None:
    flight = known(np.zeros((3400, 1, 3)), "rolling")
    for azimuth in (-60.0, 0.0):
        after, before, shown = beam_errors(flight, Array(), azimuth, 3.0, instants=4)
        assert np.abs(after).max() < 0.05 and np.abs(before).max() > 0.5
        (whole, level), (near, steered) = shown
        assert steered.max() > 0.99 and len(near) == len(steered)
        assert whole[level.argmax()] == pytest.approx(azimuth + before[0, -1], abs=0.5)
    turned = known(np.zeros((3400, 1, 3)), "rolling")
    half = math.radians(0.5)
    c, s = math.cos(half), math.sin(half)
    w, x, y, z = np.moveaxis(turned.q, -1, 0)
    turned.q[:] = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], -1)
    off = beam_errors(turned, Array(), 0.0, 3.0, instants=4)[0]
    assert off == pytest.approx(np.full(off.shape, -1.0), abs=0.05) or off == pytest.approx(
        np.full(off.shape, 1.0), abs=0.05
    )


# -- cases: each is one that filter and deck can run ----------------------------------------------


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_case_can_be_run(case: Case) -> None:
    MlsAttitude(**case.options).param_values(case.params)
    assert case.motion in MOTIONS and case.reference in ("", "prototype", "gyro")


def test_meanings_differ() -> None:
    assert len({case.meaning for case in CASES.values()}) == len(CASES)


# -- the page: every case, every verdict, plots, nothing from outside -----------------------------


@pytest.fixture
def page(runs, patterns) -> str:
    flights = {name: runs(case, 0.0123) for name, case in CASES.items()}
    targets = [
        Target(name="claim one", source="fig 3", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="claim <two>", source="fig 4", value=0.5, low=2.0),
        Target(name="three", source="fig 5", value=0.5, low=2.0, binding=False, note="because"),
    ]
    results = {name: pooled(flight) for name, flight in flights.items()}
    meanings = {name: case.meaning for name, case in CASES.items()}
    trials = {n: patterns(Array(n), 3.0, 1, 1) for n in (64, 16)}
    return render(meanings, results, flights, trials, targets)


def test_everything_is_on_the_page(page: str) -> None:
    for case in CASES.values():
        steered = 2 if case.steered else 1
        assert page.count(f"<td>{case.meaning.replace(chr(39), '&#39;')}<") == steered, case
    assert page.count('class="ok"') == 1 and page.count('class="bad"') == 2
    assert "FAIL" in page and "(reported)" in page and "because" in page
    assert "claim &lt;two&gt;" in page and "&ge; 2" in page and "&le; 1" in page
    assert page.count("<svg") == 5 == page.count("<figcaption>")
    assert page.count(">0.95<") == 40 and "64, z 05 0 at 30" in page and "16, x 01 m60" in page
    assert "beam 0 deg" in page and "uncompensated m60 deg" in page and "lag ms" in page


def test_nothing_from_outside(page: str) -> None:
    assert "http" not in page and "<script" not in page
