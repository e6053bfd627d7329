"""The experiment of 2014: figures, targets, page."""

import html
import re

import numpy as np
import pytest

from boresight.sim.attitude.ma2014 import experiment
from boresight.sim.attitude.ma2014.experiment import Ma2014, slow_and_line, spread
from boresight.sim.experiments.seeds import Runs


@pytest.fixture(scope="module")
def result():
    return Ma2014(jobs=1).run(seed=5, runs=1, say=lambda text: None)


def test_targets_of_the_paper_are_reported_and_ours_bind(result):
    assert result.good and all(np.isfinite(t.value) for t in result.targets)
    binding = [t for t in result.targets if t.binding]
    assert [t.name.partition(":")[0] for t in binding] == [
        *(["complementary filter less Kalman filter, steady gains of Table 4"] * 6),
        "ekf_quaternion",
        "ma2014_cf",
        "complementary",
        "ma2014_cf_as_printed",
    ]
    assert all(t.needs == "10 runs" for t in binding[:6])
    assert any(not t.good for t in result.targets if not t.binding)


def test_a_c_that_differs_is_not_good(monkeypatch, result):
    wrong = {"complementary": 1}
    monkeypatch.setattr(
        experiment, "count_mismatches", lambda method, log: wrong.get(method.key, 0)
    )
    monkeypatch.setattr(experiment, "_timing", lambda: {})
    for name in ("_noise_free", "figures_of"):
        monkeypatch.setattr(experiment, name, lambda *more: dict(result.figures))
    monkeypatch.setattr(experiment, "run_cases", lambda *more, **options: {})
    broken = Ma2014().run(seed=1, runs=2, say=lambda text: None)
    failed = [t.name.partition(":")[0] for t in broken.targets if t.binding and not t.good]
    assert failed == ["complementary"] and not broken.good


def test_what_holds_whatever_the_draw(result):
    """The parts of the specification that one run suffices for."""
    for name in (
        "magnetometer and accelerometer alone: sd, noise alone",
        "the paper's complementary filter: sd, noise alone",
        "eq. (3) as printed: gyro integrated at 100 Hz",
        "eq. (3) as printed violates the heading",
        "the paper's complementary filter: fixed point against float",
        "gyro error: share",
    ):
        some = [t for t in result.targets if t.name.startswith(name)]
        assert some and all(target.good for target in some), name
    (time,) = (t for t in result.targets if t.name.startswith("complementary on fast"))
    assert time.value < 3.0 and time.high == 316.0 and time.beside == {"paper": 316.0}
    assert result.figures["complementary_fast_cycles"] <= 175
    saturated = [v for name, v in result.figures.items() if name.endswith("_saturated_sum")]
    assert len(saturated) == 16 and not any(saturated)


def test_figures_are_those_of_the_errors():
    e = np.random.default_rng(1).standard_normal((50, 4, 3))
    pooled = Runs(spread("a", e)).pooled()
    roll = e[..., 1]
    assert pooled["a_sd_roll_rms"] == pytest.approx(np.sqrt(roll.var(axis=0).mean()))
    assert pooled["a_most_roll_median"] == np.median(np.abs(roll).max(axis=0))
    moving = np.median(np.abs(roll - roll.mean(axis=0)).max(axis=0))
    assert pooled["a_moving_roll_median"] == pytest.approx(moving)


def test_lines_and_shares_of_a_spectrum():
    """0.3 at 1/6 Hz and 0.4 at 1/100 Hz, on a mean: 16 parts of 25 are slow."""
    t = np.arange(4800) / 8.0
    x = 5.0 + 0.3 * np.sin(2 * np.pi * t / 6.0) + 0.4 * np.cos(2 * np.pi * t / 100.0)
    assert slow_and_line(x) == pytest.approx((0.64, 0.3))


def test_the_page_has_the_targets_and_the_tables(result):
    page = html.unescape(result.pages["ma2014.html"])
    assert not re.search(r'<script|(src|href)="http', page)
    for text in ("Table 3", "Figure 8", "Targets met", "complementary filter", "--seed 5"):
        assert text in page, text
