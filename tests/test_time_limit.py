"""Tests end, or fail with the reason."""

import signal

import pytest
from hypothesis import given
from hypothesis import strategies as st


def ring() -> None:
    """Act as if the time were over."""
    assert 0 < signal.getitimer(signal.ITIMER_REAL)[0] <= 600
    signal.raise_signal(signal.SIGALRM)


def test_a_test_that_hangs_fails() -> None:
    with pytest.raises(BaseException, match="test_that_hangs_fails has not ended after 600 s(;|$)"):
        ring()


def test_a_property_that_hangs_is_not_tried_again() -> None:
    cases = []

    @given(st.integers())
    def hang(case: int) -> None:
        cases.append(case)
        ring()

    with pytest.raises(BaseException, match="has not ended after 600 s(;|$)"):
        hang()
    assert len(cases) == 1
