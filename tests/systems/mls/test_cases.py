"""Cases: each is one that filter and deck can run."""

import pytest

from boresight.systems.mls.cases import CASES, Case
from boresight.systems.mls.deck import MOTIONS
from boresight.systems.mls.estimator import MlsAttitude


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_case_can_be_run(case: Case) -> None:
    MlsAttitude(**case.options).param_values(case.params)
    assert case.motion in MOTIONS and case.reference in ("", "prototype", "gyro")


def test_meanings_differ() -> None:
    assert len({case.meaning for case in CASES.values()}) == len(CASES)
