"""A target's band, what counts for the verdict, and how an experiment names itself."""

from __future__ import annotations

import math

import pytest

from boresight.sim.experiments.experiment import Experiment, Result, Target, grouped


@pytest.mark.parametrize(
    ("value", "low", "high", "good"),
    [
        (1.0, 1.0, 2.0, True),
        (2.0, 1.0, 2.0, True),
        (0.999, 1.0, 2.0, False),
        (2.001, 1.0, 2.0, False),
        (-9.0, None, 2.0, True),
        (9.0, 1.0, None, True),
        (9.0, None, None, True),
        (math.nan, None, None, False),
        (math.inf, 1.0, None, False),
    ],
)
def test_band(value, low, high, good):
    target = Target(name="x", source="s", value=value, low=low, high=high)
    assert target.good is good
    assert target.to_json() == {
        "name": "x",
        "source": "s",
        "value": value if math.isfinite(value) else None,
        "limit": [low, high],
        "pass": good,
    }


def test_parts_are_named_and_stand_together():
    def one(name, part, source="s"):
        return Target(name=name, part=part, source=source, value=0.0)

    all_of_them = [one("a", "x"), one("a", "y"), one("a", "x", "other"), one("b", "")]
    assert [t.to_json()["name"] for t in all_of_them] == ["a, x", "a, y", "a, x", "b"]
    assert [[t.part for t in g] for g in grouped(all_of_them)] == [["x", "y"], ["x"], [""]]


def test_a_missed_target_counts_if_it_binds():
    def missed(binding):
        return Target(name="x", source="s", value=2.0, high=1.0, binding=binding)

    met = Target(name="y", source="s", value=0.0, high=1.0)
    assert Result(figures={}, targets=(met, missed(False))).good
    assert not Result(figures={}, targets=(met, missed(True))).good
    assert not Result(figures={}, targets=(Target(name="x", source="s", value=2.0, high=1.0),)).good


def test_name_and_summary_unless_given():
    class Tracking(Experiment):
        """A target on a circle.

        More.
        """

    class Other(Tracking):
        """Another."""

        name, summary = "third", "Given."

    assert (Tracking.name, Tracking.summary) == ("tracking", "A target on a circle.")
    assert (Other.name, Other.summary, Other.runs, Other.pages) == ("third", "Given.", 100, ())
    with pytest.raises(NotImplementedError):
        Tracking().run(seed=0, runs=2, say=print)
