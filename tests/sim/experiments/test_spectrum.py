"""Spectra of known signals."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.spectrum import line_amplitude, share, spectrum

RATE = 8.0
T = np.arange(480) / RATE  # 60 s


@pytest.mark.parametrize("count", [480, 479])
def test_a_sine_of_whole_periods_is_one_line_of_its_amplitude(count):
    f = 30 * RATE / count
    s = spectrum(3.0 + 0.7 * np.sin(2 * np.pi * f * T[:count] + 0.3), RATE)
    k = int(np.argmax(s.amplitude))
    assert s.frequency[k] == pytest.approx(f) and s.amplitude[k] == pytest.approx(0.7)
    assert np.delete(s.amplitude, k).max() < 1e-12  # the mean is gone too
    assert line_amplitude(s, f + 0.4 * RATE / count) == pytest.approx(0.7)


def test_energy_is_the_variance():
    x = np.random.default_rng(1).standard_normal(479)
    s = spectrum(x, RATE)
    assert np.square(s.amplitude).sum() / 2 == pytest.approx(x.var())


def test_share_counts_from_low_up_to_but_without_high():
    x = 2.0 * np.sin(2 * np.pi * 0.5 * T) + 1.0 * np.sin(2 * np.pi * 1.0 * T)
    s = spectrum(x, RATE)
    assert share(s, 0.0, 0.75) == pytest.approx(0.8)
    assert share(s, 0.5, 1.0) == pytest.approx(0.8)
    assert share(s, 0.0, 4.0) == pytest.approx(1.0)


def test_columns_are_signals_of_their_own():
    x = np.stack([np.sin(2 * np.pi * 0.5 * T), 3 * np.sin(2 * np.pi * 0.5 * T)], axis=1)
    np.testing.assert_allclose(line_amplitude(spectrum(x, RATE), 0.5), (1.0, 3.0))


@pytest.mark.parametrize("bad", [[1.0, 2.0, 3.0], [1.0, np.nan, 2.0, 3.0, 4.0]])
def test_bad_signals(bad):
    with pytest.raises(InputError, match="^signal must have 4 finite samples or more"):
        spectrum(bad, RATE)
