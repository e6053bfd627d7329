"""Options that verbs share, and the values that they become."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace

import pytest

from boresight.model.errors import InputError
from boresight.options import model_options, number_options, params_of, progress_of
from boresight.terminal import tell

pytestmark = pytest.mark.pythons

BOTH = ["complementary", "complementary_as_printed"]


def parsed(*words: str, add=model_options) -> Namespace:
    parser = ArgumentParser()
    add(parser)
    return parser.parse_args(words)


def test_defaults() -> None:
    assert vars(parsed()) == {"config": "small", "word": 32, "params": [], "param": []}
    assert vars(parsed(add=number_options)) == {"word": 32, "params": [], "param": []}


def test_values_of_one_stand_alone_of_several_by_name(tmp_path) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"kp_roll_per_s": 2.0, "kp_pitch_per_s": 3.0}))
    args = parsed("--params", str(file), "--param", "kp_roll_per_s=1.5", "--param", "mag_gate=1")
    values = {"kp_roll_per_s": 1.5, "kp_pitch_per_s": 3.0, "mag_gate": 1.0}
    assert params_of(args, BOTH[:1]) == values
    args = parsed("--param", f"{BOTH[1]}.kp_roll_per_s=1.5")
    assert params_of(args, BOTH)[BOTH[1]] == {"kp_roll_per_s": 1.5}


@pytest.mark.parametrize(("name", "option"), [("output", "-o"), ("reproducer", "--reproducer")])
def test_a_parameter_file_is_no_output(name: str, option: str, tmp_path) -> None:
    file = tmp_path / "p.json"
    file.write_text("{}")
    args = parsed("--params", str(file))
    setattr(args, name, str(tmp_path / "." / "p.json"))
    with pytest.raises(
        InputError, match=f"found the same file as .*; choose another with {option}$"
    ):
        params_of(args, BOTH[:1])
    setattr(args, name, None)
    assert params_of(args, BOTH[:1]) == {}


@pytest.mark.parametrize(
    ("quiet", "json_", "told"), [(0, 0, tell), (1, 0, None), (0, 1, None), (1, 1, None)]
)
def test_progress(quiet, json_, told) -> None:
    assert progress_of(Namespace(quiet=bool(quiet), json=bool(json_))) is told
