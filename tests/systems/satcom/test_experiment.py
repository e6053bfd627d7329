"""The satcom experiment: which case gives which figure, target and verdict."""

import csv
import json
from importlib.resources import files

import pytest

from boresight.systems.satcom import experiment
from boresight.systems.satcom.cases import CASES, WHAT_IF
from boresight.systems.satcom.experiment import FEW, Satcom

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
    found = {r["figure"].removeprefix("satcom_"): r["prototype"] for r in rows()}
    for name, value in PROTOTYPE.items():
        assert float(found[name]) == value, name
    assert len(found) == len(rows())
    gates = {r["figure"].removeprefix("satcom_"): (r["low"], r["high"]) for r in rows()}
    assert gates["adaptive_fixed_float_max"] == ("", "0.005")
    assert gates["adaptive_fixed_float_rms"] == ("", "0.001")
    assert gates["adaptive_status_differs_sum"] == ("", "0")
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
