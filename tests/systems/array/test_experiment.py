"""The array's experiment: cases, figures, the paper's numbers, page."""

import json
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from boresight.sim.experiments.experiment import Result, Target
from boresight.sim.experiments.targets import targets_of
from boresight.systems.array import experiment
from boresight.systems.array.cases import CASES, RATES
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.experiment import Array, figures_of
from boresight.systems.array.page import render
from boresight.systems.array.printed import BUDGET, HOURLY, SIGMA, statistics
from boresight.systems.array.runs import run_array
from boresight.systems.array.world import TurningArray

# --------------------------------------------------------------------------------------------------
# the experiment: which case gives which figure, target and verdict, with stand-ins for hours


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
    outcome = figures_of(flown, words)
    assert outcome["array_least_eigenvalue_lsb"] == 800.0 and outcome["array_saturated"] == 0.0
    bad = flown["other"].figures
    bad["eigenvalue_min"][1], bad["saturated_sum"][0] = 12.0, 3.0
    bad["fixed_float_rms"][0], bad["fixed_float_max"][1] = 9.0, 10.0
    outcome = figures_of(flown, words)
    assert outcome["array_least_eigenvalue_lsb"] == 12.0 and outcome["array_saturated"] == 3.0
    assert outcome["array_fixed_float_arcsec_max"] == 10.0
    assert outcome["array_fixed_float_arcsec_rms"] > 6.0


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


# -- cases: both rates in every reading, and all of them worlds and filters that there are --------


def test_both_rates_in_every_reading() -> None:
    for key, deg_s in RATES.items():
        index, none, literal = (CASES[f"{key}_{n}"] for n in ("index", "none", "literal"))
        assert index.deg_s == none.deg_s == literal.deg_s == deg_s
        assert index.compared and not index.world and not index.options
        assert none.world == {"index": "none"} and literal.options == {"reading": "literal"}
        assert index.runs >= 8 and none.runs >= 8
    assert len({case.meaning for case in CASES.values()}) == len(CASES)


def test_worlds_and_filters_exist() -> None:
    for case in CASES.values():
        world = TurningArray(case.deg_s, hours=0.01, **case.world)
        turns = case.deg_s * 36.0 / 360.0
        none = case.world.get("index") == "none"
        assert none == (not len(world.pulses.sample)) or turns < 1.0
        assert ArrayAttitude(**case.options).name == "array_attitude"


# -- the page: every case, the paper's numbers, plots, nothing from outside -----------------------


@pytest.fixture(scope="module")
def page(runs, words) -> str:
    flown = {name: runs(0.1 * (1 + k)) for k, name in enumerate(CASES)}
    return render(flown, words, [Target(name="claim", source="text", value=0.5, high=0.2)])


def test_everything_is_on_the_page(page: str) -> None:
    for case in CASES.values():
        assert page.count(f"<td>{case.meaning}<") == 1, case
    assert page.count('class="bad"') == 1 and page.count("<svg") == 3
    minus = "\N{MINUS SIGN}"
    assert f"{minus}2.83, {minus}22.84, {minus}2.31" in page  # hour 1, but not hour 3
    assert f"{minus}1.51, {minus}31.10" not in page
    assert "7.90, 28.99, 29.83" in page and "18.61 is 0.43" in page and "60.82" in page
    assert ">59.9<" in page and "finding north" in page
    assert page.count("no index") >= 4  # both rates: a row and a legend


def test_what_is_not_compared_has_no_difference(page: str) -> None:
    shown = "0.13, 0.194"
    assert page.count(shown) == sum(case.compared for case in CASES.values())


def test_nothing_from_outside(page: str) -> None:
    assert "http" not in page and "<script" not in page


# -- what the paper prints fits what it says of it ------------------------------------------------


def test_one_sigma_is_the_deviation_of_the_hours() -> None:
    """To the last printed digit, of n - 1: which says what "1 sigma" is."""
    for key, sigma in SIGMA.items():
        assert HOURLY[key].shape == (8, 3)
        assert statistics(HOURLY[key])["sigma"] == pytest.approx(sigma, abs=0.006)
    assert statistics(HOURLY["a"])["max"].max() == 60.82
    assert statistics(HOURLY["b"])["rms"] == pytest.approx([10.5, 12.6, 18.4], abs=0.05)
    assert HOURLY["b"][:7, 2].std(ddof=1) == pytest.approx(0.43, abs=0.01)


def test_totals_are_roots_of_sums_of_squares() -> None:
    *parts, total = BUDGET.values()
    assert np.sqrt((np.array(parts) ** 2).sum(axis=0)) == pytest.approx(total, abs=0.2)


def test_one_hour_has_no_deviation() -> None:
    single = statistics(np.array([[1.0, -2.0, 3.0]]))
    assert single["sigma"].tolist() == [0.0, 0.0, 0.0] and single["max"].tolist() == [1.0, 2.0, 3.0]
