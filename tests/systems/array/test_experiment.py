"""The experiment: which case gives which figure, target and verdict, with stand-ins for hours."""

import json
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.experiment import Result
from boresight.sim.experiments.targets import targets_of
from boresight.systems.array import experiment
from boresight.systems.array.cases import CASES
from boresight.systems.array.experiment import Array, figures_of
from boresight.systems.array.runs import run_array


@pytest.fixture(scope="module")
def result(runs, words) -> Iterator[Result]:
    """Every case wrong by 0.1" more than the one before."""

    def run_cases(run, cases, *, seed, at_once, jobs, say):
        assert (seed, at_once, jobs) == (5, 1, 1)
        if run is not run_array:
            assert [(n, case) for n, case, _ in cases][:2] == [
                ("a_24", (24, 0.35, 2.0)),
                ("b_24", (24, 36.0, 2.0)),
            ]
            return words
        assert all(case.hours == 2.0 for _, case, _ in cases)
        assert {n: some for n, _, some in cases} == {n: min(9, c.runs) for n, c in CASES.items()}
        return {name: runs(0.1 * (1 + k)) for k, (name, _, _) in enumerate(cases)}

    schedules = (SimpleNamespace(interval=1000, latency=110),)
    cycles = dict.fromkeys(("small", "fast"), schedules)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "run_cases", run_cases)
        patch.setattr(experiment, "schedules_of", lambda *a: cycles)
        yield Array(hours=2.0, jobs=1).run(seed=5, runs=9, say=lambda text: None)


def test_run(result: Result) -> None:
    f = result.figures
    assert [*CASES][:2] == ["a_index", "b_index"]
    assert f["array_b_index_pitch_rms"] == pytest.approx(0.2 * 2.5**0.5)
    assert f["array_index_gain"] == pytest.approx(2.0)  # the fourth case over the second
    assert f["array_index_gain_slow"] == pytest.approx(3.0)
    assert f["array_fixed_float_arcsec_max"] == pytest.approx(648000.0 * 3e-7)
    assert f["array_words_a_24_carried_rms"] == 2.0**-24
    json.dumps([dict(f), result.details], allow_nan=False)
    page = result.pages["array.html"]
    assert page.count('class="bad"') == sum(not t.good for t in result.targets)


def test_worst_of_all_cases(runs, words) -> None:
    """One bad run anywhere is seen."""
    flown = {name: runs(1.0) for name in CASES}
    found = figures_of(flown, words)
    assert found["array_least_eigenvalue_lsb"] == 800.0 and found["array_saturated"] == 0.0
    bad = flown["other"].figures
    bad["eigenvalue_min"][1], bad["saturated_sum"][0] = 12.0, 3.0
    bad["fixed_float_rms"][0], bad["fixed_float_max"][1] = 9.0, 10.0
    found = figures_of(flown, words)
    assert found["array_least_eigenvalue_lsb"] == 12.0 and found["array_saturated"] == 3.0
    assert found["array_fixed_float_arcsec_max"] == 10.0
    assert found["array_fixed_float_arcsec_rms"] > 6.0


def test_targets_fall_where_their_figure_does(result: Result) -> None:
    def wrong(**more: float) -> list[str]:
        figures = dict(result.figures) | {"array_index_gain": 9.0} | more
        targets = targets_of("boresight.systems.array", figures)
        assert all(t.binding for t in targets)
        return [t.name for t in targets if not t.good]

    assert wrong() == []
    for key, value, name in (
        ("array_a_index_heading_rms", 40.1, "the same: heading"),
        ("array_b_index_pitch_rms", 40.1, "36 deg/s, below 40: pitch, rms"),
        ("array_b_index_heading_sigma", 18.7, "the same: heading"),
        ("array_index_gain", 7.9, "heading, no index over index, 36 deg/s"),
        ("array_fixed_float_arcsec_rms", 0.31, "fixed less float64, rms"),
        ("array_fixed_float_arcsec_max", 1.01, "fixed less float64, most"),
        ("array_least_eigenvalue_lsb", 255.0, "least eigenvalue of P"),
        ("array_saturated", 1.0, "words beyond their range"),
        ("array_interval_cycles_fast", 1061.0, "the same, fast"),
        ("array_attitude_latency_cycles_small", 141.0, "cycles to the attitude, small"),
    ):
        assert wrong(**{key: value}) == [name]


@pytest.mark.parametrize("hours", [0.5, 25.0])
def test_hours_are_checked(hours: float) -> None:
    with pytest.raises(InputError, match="^experiment array, hours: wanted 1 to 24, found"):
        Array(hours=hours)
