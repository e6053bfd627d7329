"""Cases: both rates in every reading, and all of them worlds and filters that there are."""

from boresight.systems.array.cases import CASES, RATES
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.world import TurningArray


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
