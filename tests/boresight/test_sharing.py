"""Names and parameters of several estimators; several in one compile and check."""

from __future__ import annotations

import json

import pytest

from boresight.model.errors import InputError
from boresight.sharing import estimator_names, params_for_each, params_of_each

NAMES = ["complementary", "complementary_as_printed"]


def test_names():
    assert estimator_names("complementary") == NAMES[:1]
    assert estimator_names(*NAMES) == estimator_names(",".join(NAMES)) == NAMES
    with pytest.raises(
        InputError,
        match=r"^estimators: wanted each name once, found complementary "
        r"twice; .*$",
    ):
        estimator_names("complementary", ",".join(NAMES))
    with pytest.raises(
        InputError, match=r"^estimator: wanted file.py:Class, or one of .*, found 'kalman'; .*$"
    ):
        estimator_names("complementary", "kalman")


def test_parameters_by_estimator(tmp_path):
    file = tmp_path / "p.json"
    file.write_text(
        json.dumps(
            {"estimator": NAMES[1], "parameters": {"kp_roll_per_s": 2.0, "kp_pitch_per_s": 3.0}}
        )
    )
    result = params_for_each(
        NAMES, [file], [f"{NAMES[1]}.kp_roll_per_s=1.5", "complementary.declination_ht=0.25"]
    )
    assert result == {
        NAMES[1]: {"kp_roll_per_s": 1.5, "kp_pitch_per_s": 3.0},
        "complementary": {"declination_ht": 0.25},
    }
    assert params_of_each(NAMES, result) == [{"declination_ht": 0.25}, result[NAMES[1]]]
    assert params_of_each(NAMES, {NAMES[1]: {}}) == [None, {}]
    assert params_of_each(NAMES[:1], {"x": 1.0}) == [{"x": 1.0}]
    assert params_of_each(NAMES, None) == [None, None]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            "kp_roll_per_s=1",
            r"^--param kp_roll_per_s: wanted parameters of complementary, "
            r"complementary_as_printed, found no estimator's name; write for example "
            r"--param complementary\.NAME=NUMBER$",
        ),
        ("mekf.x=1", r"^--param mekf\.x: wanted .*, found those of mekf; .*$"),
        ("complementary.x=1", r"^parameter x: wanted one of .*$"),
        ("complementary.kp_roll_per_s=-1", r"^parameter kp_roll_per_s: wanted 0 to 32 1/s, .*$"),
        ("complementary.kp_roll_per_s=a", r"^--param: wanted NAME=NUMBER, found '.*=a'; .*$"),
    ],
)
def test_parameters_of_no_estimator_are_refused(setting, message):
    with pytest.raises(InputError, match=message):
        params_for_each(NAMES, [], [setting])


def test_parameters_not_by_estimator_are_refused():
    with pytest.raises(
        InputError,
        match=r"^parameters: wanted values of complementary, .*, found "
        r"kp_roll_per_s; .*$",
    ):
        params_of_each(NAMES, {"kp_roll_per_s": 1.0})
