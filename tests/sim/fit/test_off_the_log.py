"""What `fit` writes of half of each log, on all of it: nothing saturates that does not without.

`pytest -m soak tests/sim/fit/test_off_the_log.py -s` prints the figures.
"""

from __future__ import annotations

import copy

import pytest

from boresight.model.attitude import FILTERS
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.sim.fit.fitting import Effect, effect, fitted, select_ranges
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.record import Record
from tests.support.strangers import STRANGERS, program

NAMES = (*STRANGERS, *FILTERS, "vqf(rate_hz=256)")


def _pair(name: str) -> tuple[Estimator, Record]:
    if name in STRANGERS:
        return estimator_of(program(name)), Record.of(STRANGERS[name](4000)[0])
    return estimator_of(name), read_record(bundled("ximu_walk"))


@pytest.mark.soak
@pytest.mark.parametrize("name", NAMES)
def test_half_of_a_log(name: str) -> None:
    found, record = _pair(name)
    estimator = copy.copy(found)
    estimator.profile = None
    whole = {"log": feed(estimator, record).inputs}
    half = {"log": whole["log"][: len(whole["log"]) // 2]}
    profile = select_ranges(fitted(estimator, half), half).profile
    on_all = effect(estimator, profile, whole)
    assert isinstance(on_all, Effect)
    print(f"{name}: {len(profile.ranges)} formats, {on_all.saturated_updates} saturated")
    assert on_all.saturated_updates == 0
