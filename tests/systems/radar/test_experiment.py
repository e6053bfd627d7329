"""The radar experiment: figures of runs that are known, which of them is judged how."""

import json
from types import SimpleNamespace

import pytest

from boresight.systems.radar import experiment
from boresight.systems.radar.experiment import AT, Radar
from tests.support.radar_figures import found, spread, targets, theory, watched


def test_figures() -> None:
    data = found()
    assert data["registration_fixed_float_percent"] == 0.02
    assert data["registration_range_2_percent"] == pytest.approx(1.5)
    assert data["registration_range_1_spread_ratio"] == 1.0
    assert data["registration_range_1_mean_offset"] == pytest.approx(0.5)
    assert data["registration_range_1_bound_percent"] == pytest.approx(250.0)
    assert data["registration_track_1_gain_percent"] == pytest.approx(98.0)
    assert data["registration_track_1_gain_noise_percent"] == pytest.approx(80.0)
    assert AT == 800


def verdicts(**more: float) -> dict[str, bool]:
    return {f"{t.name}, {t.part}": t.good for t in targets(**more) if t.binding}


def test_targets_fall_where_their_figure_does() -> None:
    assert all(verdicts().values())
    for key, value, name in (
        ("registration_range_1_percent", 2.1, "noise-free, 80 s, range 1"),
        ("registration_azimuth_2_percent", 0.16, "noise-free, 80 s, azimuth 2"),
        ("registration_azimuth_1_spread_ratio", 1.16, "spread over the bound, azimuth 1"),
        ("registration_azimuth_1_spread_ratio", 0.86, "spread over the bound, azimuth 1"),
        ("registration_range_2_mean_offset", -1.1, "mean error, in bands, range 2"),
        ("registration_fixed_float_percent", 0.11, "fixed less float64, "),
        ("registration_saturated", 1.0, "words beyond their range, "),
        ("registration_interval_cycles_fast", 761.0, "cycles to the next record, fast"),
        ("registration_track_2_gain_percent", 95.0, "tracks better, noise-free, radar 2"),
    ):
        wrong = [n for n, good in verdicts(**{key: value}).items() if not good]
        assert wrong == [name]


def test_what_the_bound_forbids_does_not_bind() -> None:
    forbidden = [t for t in targets() if not t.binding]
    assert len(forbidden) == 6 and not any(t.good for t in forbidden)


def test_run(monkeypatch) -> None:
    """Which run is asked for, and that page and figures hold together."""
    asked = []

    def watch(world, params):
        asked.append((world.noises.any(), len(world.place), params["p0_range_1"]))
        return watched(1.0 if not world.noises.any() else 10.0)

    monkeypatch.setattr(experiment, "watch", watch)
    monkeypatch.setattr(experiment, "campaign", lambda seed, runs, say, jobs: spread())
    monkeypatch.setattr(experiment, "predicted", lambda *a: theory())
    cycles = dict.fromkeys(("small", "fast"), (SimpleNamespace(interval=700),))
    monkeypatch.setattr(experiment, "schedules_of", lambda *a: cycles)
    result = Radar().run(seed=3, runs=20, say=lambda text: None)
    assert asked[:2] == [(False, 1701, 1000.0), (True, 1701, 5.0)]
    assert [a[:2] for a in asked[2:]] == 5 * [(False, 801)]
    json.dumps([result.figures, result.details], allow_nan=False)
    assert result.good and result.pages["radar.html"].count("no estimator can") == 6


def test_a_short_campaign() -> None:
    """Two draws, here, of the real thing."""

    data = experiment.campaign(1, 2, lambda text: None, 1)
    assert data["runs"] == 2 and data["marks"][-1] == AT
    assert data["nis"]["mean"] == pytest.approx(1.0, abs=0.1)
