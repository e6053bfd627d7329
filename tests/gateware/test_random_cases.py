"""Random programs in one core: interpreter, C and proofs agree; RTL in long campaigns."""

from __future__ import annotations

import pytest

from boresight.sim.rtl.simulators import available
from tests.support.random_case import check, drawn


@pytest.mark.parametrize(
    "seed", [*range(10), *(pytest.param(k, marks=pytest.mark.soak) for k in range(10, 1000))]
)
def test_all_forms_agree(seed: int) -> None:
    case = drawn(seed)
    assert not (wrong := check(case)), f"{case}: {wrong}"


@pytest.mark.soak
@pytest.mark.skipif(not available("verilator"), reason="needs Verilator")
@pytest.mark.parametrize("seed", range(1000))
def test_the_rtl_agrees(seed: int) -> None:
    case = drawn(seed, rtl=True)
    assert not (wrong := check(case)), f"{case}: {wrong}"
