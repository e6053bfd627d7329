"""Filters by name, and whose parameters are whose."""

from __future__ import annotations

import pytest

from boresight.filters import chosen, params_by_estimator
from boresight.model.errors import InputError
from boresight.sim.accuracy.peers import PEERS


def test_names():
    ours, peers = chosen("all")
    assert {"mekf", "complementary"} <= set(ours) and peers == list(PEERS)
    assert chosen("ours") == (ours, []) and chosen("published") == ([], list(PEERS))
    assert chosen(["mekf,vqf_online", "f.py:A(n=[1,2])"]) == (
        ["mekf", "f.py:A(n=[1,2])"],
        ["vqf_online"],
    )
    with pytest.raises(InputError, match="^estimators: .*each once, found mekf twice"):
        chosen("ours,mekf")


def test_parameters_find_their_estimator(tmp_path):
    first, two = tmp_path / "one.json", tmp_path / "two.json"
    first.write_text('{"estimator": "complementary", "parameters": {"mag_gate": 1}}')
    two.write_text('{"mag_gate": 2}')
    both = ["complementary", "complementary_as_printed"]
    assert params_by_estimator(both, [first]) == {"complementary": {"mag_gate": 1.0}}
    assert params_by_estimator(["complementary"], [first, two], ["mag_gate=3"]) == {
        "complementary": {"mag_gate": 3.0}
    }
    assert params_by_estimator(both, [first], ["complementary_as_printed.mag_gate=3"]) == {
        "complementary": {"mag_gate": 1.0},
        "complementary_as_printed": {"mag_gate": 3.0},
    }
    assert params_by_estimator(both) == {} == params_by_estimator(["complementary"])
    for names, files, settings, message in (
        (both, [two], [], r"two.json: wanted parameters of .* found no estimator's name"),
        (both, [], ["mag_gate=1"], r"found no estimator's name"),
        ([], [], ["mag_gate=1"], r"wanted an estimator with parameters, found published"),
        (["complementary_as_printed"], [first], [], r"found those of complementary;"),
        (["complementary"], [], ["mag_gate=9"], r"wanted 0 to 3.9"),
    ):
        with pytest.raises(InputError, match=message):
            params_by_estimator(names, files, settings)
