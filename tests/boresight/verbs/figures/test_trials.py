"""What is tuned on, and by what name it is held back."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.records.bundled import bundled
from boresight.verbs.figures.trials import trials_of

LOGS = [synthetic_log(seconds=4, rate_hz=25, seed=seed, name=f"log{seed}") for seed in (2, 1)]


def test_logs_in_the_order_of_their_names() -> None:
    result = trials_of(estimator_of("complementary"), [*LOGS, bundled("ximu_walk")], None)
    assert result.names == ("log1", "log2") == result.held_back("logs")
    assert result.left_out == ("ximu_walk",) and result.units["total"] == "deg"
    with pytest.raises(InputError, match=r"^hold: wanted logs, or with a protocol cases"):
        result.held_back("cases")


def test_logs_in_cases() -> None:
    result = trials_of(estimator_of("complementary"), LOGS, "glance")
    groups = ("as recorded", "bias 0.7 deg/s", "starts anywhere")
    assert result.names[0] == "log1, as recorded" and len(result.feeds) == 6
    assert result.held_back("logs") == ("log1",) * 3 + ("log2",) * 3
    assert result.held_back("cases") == groups * 2
    assert result.units == dict.fromkeys(groups, "deg")
    with pytest.raises(InputError, match=r"^hold: "):
        result.held_back("nothing")
