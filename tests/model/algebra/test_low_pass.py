"""The low-pass is scipy's Butterworth behind a mean, and keeps its bits at any corner."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal

from boresight.firmware.build import CModel
from boresight.model import ops
from boresight.model.algebra.low_pass import LowPass, filtered, gain_of
from boresight.model.estimator import Estimator, Input, Output, State, input_words

CASES = [(3.0, 1e-3), (0.5, 0.01), (0.05, 0.01), (0.05, 0.1), (0.05, 0.09), (0.04, 0.1)]


class Smooth(Estimator):
    """One channel; an input of 2 and more is no sample."""

    inputs = (Input("x", -1.0, 2.0),)
    outputs = (Output("y"),)

    def __init__(self, tau_s: float, step_s: float) -> None:
        self.low_pass = LowPass(tau_s, step_s)
        _, z, v = self.low_pass.largest
        n = self.low_pass.mean_samples
        self.states = (State("z", -z, z), State("v", -v, v), State("n", 0.0, float(n)))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        n = self.low_pass.mean_samples
        mean, hold = x.n < n - 0.5, u.x > 1.5
        weights = self.low_pass.weights(mean, ops.bounded(1.0 / (x.n + 1.0), 0.0, 1.0, "1/n"))
        sample = ops.bounded(ops.where(hold, 0.0, u.x), -1.0, 1.0, "a sample")
        (y,), ((z, v),) = filtered(weights, self.low_pass, [(x.z, x.v)], [sample], 1.0, hold)
        count = ops.where(hold, x.n, ops.minimum(x.n + 1.0, float(n)))
        return {"z": z, "v": v, "n": count}, {"y": y}


def by_scipy(low_pass: LowPass, x: Any) -> Any:
    """Mean of the first samples, then the filter in the steady state of the last mean."""
    n = low_pass.mean_samples
    mean = np.cumsum(x)[:n] / np.arange(1, n + 1)
    if low_pass.tau_s < low_pass.step_s / 2:
        return np.concatenate([mean, x[n:]])
    corner = np.sqrt(2.0) / (2.0 * np.pi * low_pass.tau_s)
    b, a = signal.butter(2, corner, fs=1.0 / low_pass.step_s)
    rest, _ = signal.lfilter(b, a, x[n:], zi=signal.lfilter_zi(b, a) * mean[-1])
    return np.concatenate([mean, rest])


def samples(low_pass: LowPass) -> Any:
    rng = np.random.default_rng(1)
    n = 3 * low_pass.mean_samples + 200
    return np.where(np.arange(n) % 7 < 3, 0.7, -0.2) + rng.uniform(-0.3, 0.3, n)


@pytest.mark.parametrize("tau_s, step_s", CASES)
def test_as_scipy_has_it(tau_s: float, step_s: float) -> None:
    made = Smooth(tau_s, step_s)
    x = samples(made.low_pass)
    y = made.run_float(x[:, None, None]).outputs["y"][:, 0]
    b = made.low_pass.coefficients[0]
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-15 / b + 1e-14  # theirs is direct


@pytest.mark.parametrize("tau_s, step_s", [(3.0, 1e-3), (0.05, 0.09)])
def test_fixed_point_keeps_its_bits(tau_s: float, step_s: float) -> None:
    """Within 1e-6 (the corner's own word), where the direct form has 1/(4 b) LSB, here 4e-3."""
    made = Smooth(tau_s, step_s)
    program = made.compile()
    x = samples(made.low_pass)
    out, saturated = CModel(program).update(input_words(program, x[:, None, None])[:, :, 0])
    y = program.format(program.outputs[0]).real(out[:, 0])
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-6
    assert not saturated.any()


@pytest.mark.parametrize("tau_s, step_s", [(0.5, 0.01), (0.05, 0.09)])
def test_the_largest_input_reaches_its_bounds_and_no_more(tau_s: float, step_s: float) -> None:
    made = Smooth(tau_s, step_s)
    corner = np.sqrt(2.0) / (2.0 * np.pi * tau_s)
    b, a = signal.butter(2, corner, fs=1.0 / step_s)
    n = 40 * made.low_pass.mean_samples
    impulse = signal.lfilter(b, a, np.eye(1, n)[0])
    worst = np.sign(impulse[::-1])
    y = made.run_float(np.concatenate([np.full(n, worst[0]), worst])[:, None, None]).outputs["y"]
    bound = made.low_pass.largest[0]
    assert 0.99 * bound < np.abs(y).max() <= bound
    assert bound == pytest.approx(np.abs(impulse).sum(), rel=2e-3)


def test_without_a_sample_nothing_changes() -> None:
    made = Smooth(0.05, 0.01)
    x = samples(made.low_pass)
    sparse = np.full(3 * len(x), 2.0)
    sparse[::3] = x
    y = made.run_float(sparse[:, None, None]).outputs["y"][::3, 0]
    assert np.abs(y - by_scipy(made.low_pass, x)).max() < 1e-12


def test_the_mean_lasts_until_tau_is_over() -> None:
    assert [LowPass(0.05, s).mean_samples for s in (0.01, 0.05, 0.06, 0.011)] == [5, 1, 1, 5]
    assert LowPass(3.0, 1.0 / 285.714).mean_samples == 858


def test_first_order_gain() -> None:
    assert gain_of(9.0, 0.01) == pytest.approx(1.0 - np.exp(-0.01 / 9.0), rel=1e-12)
