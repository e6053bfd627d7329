"""The strapdown in short words: carried remainders are what keeps it."""

from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.words import Plain, run_width


def test_carried_remainders_keep_the_attitude() -> None:
    """Words of 24 bits, slowly: without remainders the error is many times as large."""
    f = run_width((24, 0.35, 0.05), range(1, 2)).pooled()
    assert 0.0 < 10.0 * f["carried_rms"] < f["plain_rms"]


def test_nothing_but_the_remainders_is_left_out() -> None:
    whole, plain = ArrayAttitude(aided=False), Plain(aided=False)
    assert [s.name for s in whole.states] == [s.name for s in plain.states]
    assert any(s.name.startswith("rest_") for s in plain.states)
