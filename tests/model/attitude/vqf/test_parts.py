"""VQF's parts: rest, motion, field, bias, settings."""

import pytest

from boresight.model.attitude.vqf import Settings

# -- coefficients are those of the authors' own implementation ------------------------------------


@pytest.mark.parametrize("rate", [10.0, 25.0, 50.0, 100.0, 142.857, 256.0, 285.714, 1000.0])
def test_samples_are_sums_of_float64(rate: float) -> None:
    s = Settings(rate, rate)
    step = 1.0 / rate

    def summed(n: int) -> float:
        total = 0.0
        for _ in range(n):
            total += step
        return total

    for n, seconds in (
        (s.rest_samples, 1.5),
        (s.calm_samples, 0.5),
        *zip(s.candidate_samples, (5.0, 20.0), strict=True),
        (s.rejected_samples + 1, 60.0 + 1e-300),
    ):
        assert summed(n - 1) < seconds <= summed(n) or n == s.rejected_samples + 1
    assert summed(s.rejected_samples) <= 60.0 < summed(s.rejected_samples + 1)
    gain, n = 1.0, 0
    while gain != 0.0:  # as the package counts them
        gain, n = gain / (gain + 1.0), n + 1
        gain = 0.0 if gain * 9.0 < step else gain
    assert s.first_samples == n
