"""The experiment on satcom: cases, flights, page."""

import csv
import dataclasses
import json
from importlib.resources import files

import numpy as np
import pytest

from boresight.sim.experiments.experiment import Target
from boresight.sim.levels.level import Run
from boresight.systems.satcom import experiment
from boresight.systems.satcom import runs as flight
from boresight.systems.satcom.cases import CASES, WHAT_IF
from boresight.systems.satcom.drive import DRIVES
from boresight.systems.satcom.estimator import Satcom as SatcomFilter
from boresight.systems.satcom.experiment import FEW, Satcom
from boresight.systems.satcom.page import render
from boresight.systems.satcom.runs import ANGLES, SETTLED_S, figures_of, fly

# -- the satcom experiment: which case gives which figure, target and verdict ---------------------

#: Rows of the specification's table: what is measured, and what its float prototype found.
PROTOTYPE = {
    **{"adaptive_roll_rms": 0.05, "adaptive_pitch_rms": 0.031, "adaptive_heading_rms": 0.052},
    **{"adaptive_roll_max": 0.18, "adaptive_pitch_max": 0.10, "adaptive_heading_max": 0.17},
    **{"fixed_r_roll_rms": 6.6, "fixed_r_pitch_rms": 16.0, "fixed_r_heading_rms": 1.8},
    **{"fixed_r_pitch_max": 80.0, "no_tracking_heading_rms": 7.6, "no_tracking_bias_z_end": 0.486},
    **{"adaptive_bias_x_end": 0.299, "adaptive_bias_y_end": -0.4, "adaptive_bias_z_end": 0.5},
    **{"pi_alone_loop_rms": 0.066, "pi_slow_loop_rms": 0.059, "pi_1hz_loop_rms": 0.18},
    **{"adaptive_hit_rate": 1.0, "adaptive_false_rate": 0.0, "printed_roll_roll_rms": 5.7},
}


def rows() -> list[dict[str, str]]:
    table = files("boresight.systems.satcom").joinpath("targets.csv")
    return list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))


def test_every_row_of_the_specification_is_there() -> None:
    results = {r["figure"].removeprefix("satcom_"): r["prototype"] for r in rows()}
    for name, value in PROTOTYPE.items():
        assert float(results[name]) == value, name
    assert len(results) == len(rows())
    gates = {r["figure"].removeprefix("satcom_"): (r["low"], r["high"]) for r in rows()}
    assert gates["adaptive_fixed_float_max"] == ("", "0.005")
    assert gates["adaptive_fixed_float_rms"] == ("", "0.001")
    assert gates["adaptive_agreed_max"] == ("", "0.005")
    assert gates["adaptive_status_share"] == ("", "1e-5")
    shown = {r["figure"].removeprefix("satcom_") for r in rows() if r["reported"]}
    assert shown == {"adaptive_fixed_float_max", "adaptive_status_differs_sum"}
    for axis in ("roll", "pitch", "heading"):
        assert gates[f"adaptive_{axis}_rms"] == ("", "0.06")
    assert gates["fixed_r_worst_rms"] == ("1", "") and gates["adaptive_loss_db_99_max"][1] == "0.5"


@pytest.fixture
def standing_in(monkeypatch, runs):
    """`run_cases` that gives what a few short flights gave; what it was asked for."""
    asked = {}

    def run_cases(run, cases, *, seed, at_once, jobs, say):
        asked.update({name: (case, some) for name, case, some in cases}, seed=seed, jobs=jobs)
        asked["first"] = cases[0][0]
        return {name: runs.get(name, runs["adaptive"]) for name, _, _ in cases}

    monkeypatch.setattr(experiment, "run_cases", run_cases)
    return asked


def test_run(standing_in, runs) -> None:
    result = Satcom(jobs=1).run(seed=5, runs=60, say=lambda text: None)
    assert standing_in["seed"] == 5 and standing_in["jobs"] == 1 and standing_in["first"] == "city"
    for name, case in (CASES | WHAT_IF).items():
        assert standing_in[name] == (case, 60 if name in CASES else FEW)
    verdicts = {t.name: t.good for t in result.targets}
    assert len(result.targets) == len(rows())
    assert verdicts["with R fixed a manoeuvre ruins it: worst axis"]
    assert not verdicts["without tracking the heading drifts"]  # an adaptive run stands in
    adaptive = runs["adaptive"].pooled()
    for name, key in (
        *((f"{a}_deg", f"{a}_rms") for a in ("roll", "pitch", "heading")),
        ("fixed_float_deg", "fixed_float_max"),
        ("fixed_float_rms_deg", "fixed_float_rms"),
        ("pointing_loss_db", "loss_db_99_max"),
        ("bias_error_deg_s", "bias_error_max"),
        ("adaptive_hit_rate", "hit_rate"),
    ):
        assert result.figures[f"satcom_{name}"] == adaptive[key]
    fixed = runs["fixed_r"].pooled()["worst_rms"]
    assert result.figures["satcom_fixed_r_deg"] == fixed > 1.0
    assert result.figures["satcom_interval_cycles_small"] <= 950
    assert result.figures["satcom_interval_cycles_fast"] <= 500
    json.dumps([result.figures, result.details], allow_nan=False)
    judged = [t.good for t in result.targets if (t.low, t.high) != (None, None)]
    assert result.pages["satcom.html"].count('class="bad"') == judged.count(False)


def test_targets_say_where_they_come_from(standing_in, runs) -> None:
    by_name = {t.name: t for t in Satcom().run(seed=5, runs=60, say=lambda text: None).targets}
    heading = by_name["heading of the PI loop alone, 0.5 rad/s"]
    assert heading.source == "step 3, H2" and heading.beside == {"prototype": 0.066}
    first = by_name["small with adaptive R and tracking: roll"]
    own = runs["adaptive"].figures["roll_rms"]
    assert first.spread == (own.min(), own.max()) and first.unit == "deg"


# -- figures of a flight: claims in short, and errors that are known beforehand -------------------

BEGUN = round(50 * SETTLED_S)


def test_claims_hold_and_what_was_printed_fails(runs) -> None:
    good = runs["adaptive"].pooled()
    assert max(good["roll_rms"], good["pitch_rms"]) < 0.06 and good["heading_rms"] < 0.1
    assert good["hit_rate"] > 0.99 and good["false_rate"] < 0.01
    assert good["bias_error_max"] < 0.05 and good["loss_db_99_max"] < 0.5
    assert good["fixed_float_max"] < 0.005 and good["fixed_float_rms"] < 0.001
    assert good["status_differs_sum"] == 0 == good["saturated_sum"]
    for name in ("fixed_r", "printed_roll"):
        assert runs[name].pooled()["worst_rms"] > 1.0, name


def test_innovations_are_consistent_where_r_is(runs) -> None:
    for axis in ANGLES:
        pooled = runs["declared"].pooled()
        assert 0.7 < pooled[f"nis_{axis}"] < 1.35 and abs(pooled[f"rho_{axis}"]) < 0.15
    cautious = runs["adaptive"].pooled()
    assert cautious["nis_roll"] < 0.5 and cautious["nis_heading"] < 0.5
    assert [len(run) for run in runs["adaptive"].each] == [3, 3]


def test_figures_of_known_errors(adaptive, monkeypatch) -> None:
    fleet, loops = adaptive
    n, zero = len(loops.inputs), np.zeros(loops.inputs.shape[:2])
    half = 180.0
    wrong = {"roll": 3.0, "pitch": 1.0, "heading": -2.0, "heading_pi": 4.0}
    truth = {
        "roll": fleet.drive.ride.euler[:, 0] / np.pi,
        "pitch": fleet.drive.ride.euler[:, 1] / np.pi,
        "heading": fleet.heading / np.pi,
        "heading_pi": fleet.heading / np.pi,
    }
    outputs = {name: zero + truth[name][:, None] + off / half for name, off in wrong.items()}
    outputs["roll"][:BEGUN] += 0.5
    outputs["pitch"][:, 1] -= 4.0 / half  # of the second run -3
    outputs["heading"] += 2.0  # a turn more is the same heading
    outputs |= {f"bias_{a}": zero + fleet.bias[:, :, k] for k, a in enumerate("xyz")}
    outputs["bias_y"][-1, 0] += np.radians(0.01)
    moving = fleet.drive.accelerated
    outputs["status"] = zero + np.where(moving, 1.0, 2.0)[:, None]
    fleet = dataclasses.replace(fleet, losses_db=[])
    fleet.start()
    fleet.losses_db.extend(np.linspace(0.0, 1.0, n)[:, None] * [1.0, 2.0])
    saturated = np.arange(n)[:, None] < [3, 4]
    known = dataclasses.replace(loops, run=Run(outputs, saturated=saturated))
    monkeypatch.setattr(flight, "_float_errors", lambda *a: ({"apart": 1.0}, []))
    outcome = figures_of(CASES["adaptive"], fleet, known).figures
    assert outcome["roll_rms"] == pytest.approx([3.0, 3.0])
    assert outcome["pitch_rms"] == pytest.approx([1.0, 3.0]) == outcome["pitch_max"]
    assert outcome["heading_rms"] == pytest.approx([2.0, 2.0])
    assert outcome["loop_rms"] == pytest.approx([4.0, 4.0])
    assert outcome["worst_rms"] == pytest.approx([3.0, 3.0])
    assert outcome["bias_error_max"] == pytest.approx([0.01, 0.0], abs=1e-9)
    assert outcome["bias_y_end"] == pytest.approx([-0.39, -0.4])
    assert outcome["loss_db_max"] == pytest.approx([1.0, 2.0])
    first = BEGUN / (n - 1)
    assert outcome["loss_db_99_max"] == pytest.approx(
        (1.0 - 0.01 * (1.0 - first)) * np.array([1, 2])
    )
    assert outcome["hit_rate"].tolist() == [1.0, 1.0] and outcome["false_rate"].tolist() == [
        0.0,
        0.0,
    ]
    assert outcome["tracking_used"] == pytest.approx(moving[BEGUN:].mean() * np.ones(2))
    assert outcome["saturated_sum"].tolist() == [3.0, 4.0] and outcome["apart"].tolist() == [
        1.0,
        1.0,
    ]


def test_float64_is_run_beside(adaptive) -> None:
    """Its difference and its status words are those of a wrong output that is told."""
    fleet, loops = adaptive
    honest = figures_of(CASES["adaptive"], fleet, loops).figures
    bent = {**loops.outputs, "roll": loops.outputs["roll"].copy()}
    bent["roll"][100, 1] += 0.5 / 180.0
    bent["status"] = loops.outputs["status"].copy()
    bent["status"][[3, 5, 8], 0] += 4.0
    bent_loops = dataclasses.replace(loops, run=dataclasses.replace(loops.run, outputs=bent))
    outcome = figures_of(CASES["adaptive"], fleet, bent_loops).figures
    assert outcome["fixed_float_max"] == pytest.approx(
        [honest["fixed_float_max"][0], 0.5], abs=5e-3
    )
    assert outcome["status_differs_sum"].tolist() == [3.0, 0.0]
    assert outcome["status_share"].tolist() == [3.0 / len(loops.inputs), 0.0]
    assert outcome["agreed_max"] == pytest.approx([0.0, 0.5], abs=5e-3)
    assert (outcome["nis_roll"] == honest["nis_roll"]).all()


def test_fly(monkeypatch, adaptive) -> None:
    """The case's own filter, parameters and vehicles."""
    asked = []

    def close(fleet, level, keep):
        build = level.build
        asked.append((build.estimators[0].printed_roll, dict(build.params[0]), fleet.seeds))
        return level.name

    monkeypatch.setattr(flight, "close_loop", close)
    monkeypatch.setattr(flight, "figures_of", lambda case, fleet, loops: (case.meaning, loops))
    assert fly(CASES["fixed_r"], range(4, 6)) == ("R fixed", "c")
    fly(CASES["printed_roll"], range(1))
    assert asked == [(False, {"adapt": 1.0}, range(4, 6)), (True, {}, range(1))]
    assert SatcomFilter(roll="printed").printed_roll


# -- the cases: each can be flown, and is what its name says --------------------------------------


def test_parameters_and_options_are_those_of_the_filter() -> None:
    for case in (CASES | WHAT_IF).values():
        SatcomFilter(**case.options).param_values(case.params)
        assert case.drive in DRIVES
    assert not any(case.params or case.options for case in WHAT_IF.values())
    assert not set(CASES) & set(WHAT_IF)


def test_fleets() -> None:
    fleet = WHAT_IF["hz_200"].fleet(range(3, 5))
    assert fleet.drive.ride.rate_hz == 200.0 and list(fleet.seeds) == [3, 4]
    assert CASES["no_tracking"].fleet(range(1)).tracking_hz == 0.0
    assert CASES["pi_alone"].fleet(range(1)).beam == "heading_pi"
    assert WHAT_IF["bias_1"].fleet(range(1)).errors.gyro_bias == (1.0, -1.0, 1.0)


@pytest.mark.parametrize(
    "name, elevation", [("equator", 85.0), ("north", 16.0), ("east", 28.0), ("west", 25.0)]
)
def test_places_are_where_they_say(name: str, elevation: float) -> None:
    import math

    fleet = WHAT_IF[name].fleet(range(1))
    assert -math.degrees(math.asin(fleet._up[2])) == pytest.approx(elevation, abs=2.0)


# -- the page: every case, every verdict, plots, nothing from outside -----------------------------


@pytest.fixture(scope="module")
def page(runs) -> str:
    results = {name: runs.get(name, runs["adaptive"]) for name in (*CASES, *WHAT_IF)}
    return render(results, [Target(name="one", source="ours", value=1.0)], 7, 12)


def test_everything_is_on_the_page(page: str) -> None:
    for case in (CASES | WHAT_IF).values():
        assert case.meaning.replace(">", "&gt;") in page
    assert "12 runs, seeds 7 to 18" in page
    assert page.count("<svg") == 6 == page.count("<figcaption>")  # innovations twice, four flights
    assert "autocorrelation" in page and "loss, dB" in page


def test_nothing_from_outside(page: str) -> None:
    assert "<script" not in page and 'src="' not in page and 'href="http' not in page
