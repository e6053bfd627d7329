"""Parameter values from Python, from texts and from files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from boresight.gateware.description import describe
from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.options import estimator_names, params_of, params_of_each
from boresight.sim.levels.build import Build

BOTH = ["battery", "pmsm"]


def test_of_one(here: Path) -> None:
    Path("flat.json").write_text('{"alpha": 0.5, "beta": 3}')
    Path("tuned.json").write_text(json.dumps({"estimator": "mine", "parameters": {"beta": 4}}))
    assert params_of("mine.py", None) is None
    assert params_of("mine.py", {"alpha": 0.25}) == {"alpha": 0.25}
    texts = ["@flat.json", "@tuned.json", "alpha=0.75"]
    assert params_of("mine.py", texts) == {"alpha": 0.75, "beta": 4.0}


def test_of_several() -> None:
    names = [*map(str, estimator_names(*BOTH))]
    assert names == BOTH == [*map(str, estimator_names(",".join(BOTH)))]
    assert params_of_each(BOTH, {"pmsm": {}}) == [None, {}]


def test_of_a_compiled_core(here: Path) -> None:
    build = Build(estimator_of("mine.py"), params=[{"alpha": 0.75}])
    Path("registers.json").write_text(describe(build.core).to_json())
    (values,) = params_of_each(["mine.py"], ["@registers.json"])
    assert values == {"alpha": 0.75, "beta": 2.0}
    with pytest.raises(InputError, match=r"registers\.json: wanted values of pmsm, found mine; "):
        params_of("pmsm", ["@registers.json"])


WRONG = {
    "alpha": "--param: wanted NAME=NUMBER, found 'alpha'",
    "gamma=1": "gamma",
    "alpha=7": "alpha: wanted 0 to 1, found 7",
    "@list.json": "list.json: wanted a JSON object with parameter values, found a list",
    "@other.json": "other.json: wanted values of mine, found pmsm",
    "@text.json": "text.json, alpha: wanted a number, found",
    "@nosuch.json": "nosuch.json: wanted a parameter file",
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_ones(text: str, here: Path) -> None:
    Path("list.json").write_text("[1]")
    Path("text.json").write_text('{"alpha": "high"}')
    Path("other.json").write_text('{"estimator": "pmsm", "parameters": {}}')
    with pytest.raises(InputError, match=WRONG[text]):
        params_of("mine.py", [text])


def test_whose_values_they_are() -> None:
    with pytest.raises(InputError, match="wanted values of battery, pmsm, found no estimator"):
        params_of_each(BOTH, ["alpha=1"])
    with pytest.raises(InputError, match="each name once, found pmsm twice"):
        estimator_names("pmsm,battery", "pmsm")
