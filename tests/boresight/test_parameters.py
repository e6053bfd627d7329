"""`boresight.parameters`: files and texts, and what is refused."""

from __future__ import annotations

import json

import pytest

from boresight.model.errors import InputError
from boresight.parameters import parse_settings, read_params, values_for

pytestmark = pytest.mark.pythons


def write(tmp_path, data, name="p.json"):
    path = tmp_path / name
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return path


def test_files_and_settings_in_order(tmp_path):
    flat = write(tmp_path, {"kp_pitch_per_s": 1, "kp_roll_per_s": 2.0})
    full = write(
        tmp_path,
        {"estimator": "complementary", "parameters": {"kp_roll_per_s": 3.0}, "rmse_deg": {}},
        "full.json",
    )
    assert read_params(flat) == (None, {"kp_pitch_per_s": 1.0, "kp_roll_per_s": 2.0})
    assert read_params(full) == ("complementary", {"kp_roll_per_s": 3.0})
    assert values_for("complementary", [flat, full], ["kp_heading_per_s=4", "mag_gate=1"]) == {
        "kp_pitch_per_s": 1.0,
        "kp_roll_per_s": 3.0,
        "kp_heading_per_s": 4.0,
        "mag_gate": 1.0,
    }
    assert values_for("complementary", [full], ["kp_roll_per_s=5"]) == {"kp_roll_per_s": 5.0}
    assert parse_settings(["a=1", "a=2e-3"]) == {"a": 2e-3}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("{", "wanted a parameter file, found no JSON in line 1, column 2"),
        ([1.0], "found a list"),
        ({"parameters": [1.0]}, "found a list"),
        ({"estimator": 3, "parameters": {}}, "wanted a JSON object"),
        ({"kp_pitch_per_s": "1"}, "kp_pitch_per_s: wanted a number, found '1'"),
        ({"kp_pitch_per_s": True}, "found true"),
        ({"kp_pitch_per_s": 40}, "wanted 0 to 32 1/s, found 40.0"),
        ('{"kp_pitch_per_s": NaN}', "wanted a parameter file, found NaN, which JSON does not have"),
        ({"kp": 1}, "parameter kp: wanted one of 13 names, nearest: kp_roll_per_s"),
        (
            {"estimator": "complementary_as_printed", "parameters": {}},
            "wanted parameters of complementary, found those of complementary_as_printed",
        ),
    ],
)
def test_bad_files(tmp_path, data, message):
    with pytest.raises(InputError, match=rf"/p\.json.*{message}"):
        values_for("complementary", [write(tmp_path, data)])


def test_bad_settings(tmp_path):
    for text in ("kp_pitch_per_s", "kp_pitch_per_s=x", "=", "kp_pitch_per_s="):
        with pytest.raises(InputError, match=r"wanted NAME=NUMBER"):
            values_for("complementary", [], [text])
    with pytest.raises(InputError, match=r"absent.json: wanted a parameter file that can be read"):
        read_params(tmp_path / "absent.json")
    with pytest.raises(InputError, match=r"found 'kalman'"):
        values_for("kalman")
