"""Settings of a `Vqf`: rates, time constants, and the numbers that follow from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from boresight.model import ops
from boresight.model.algebra.low_pass import LowPass, gain_of
from boresight.model.errors import InputError

DEGREE = math.pi / 180.0
CLIP_RAD_S = 2.0 * DEGREE  #: largest bias, and unit of the states that hold it.
RATE_MOST = 40.0  #: rad/s, of an axis of the gyro.
ACC_MOST = 160.0  #: m/s^2, of an axis of the accelerometer.
ROOT_3 = 1.7321  #: of three components of at most one.
FORCE_MOST = 278.0  #: m/s^2, three components of the accelerometer.
FIELD_MOST = 444.0  #: uT, three components of 256.


def counter_limit(samples: float) -> float:
    """Where a counter that must reach ``samples`` stops: a power of two, which costs nothing."""
    mantissa, exponent = math.frexp(samples + 1.0)
    return math.ldexp(1.0, exponent - (mantissa == 0.5))


def counted(x: Any, samples: float) -> Any:
    """One more, as far as the counter goes."""
    return ops.saturated(x + 1.0, counter_limit(samples))


def _samples_until(limit_s: float, step_s: float) -> int:
    """Samples after which a float64 sum of steps is no longer below a limit.

    Counters hold whole samples, which fixed point keeps exactly.
    """
    total, n = 0.0, 0
    while total < limit_s:
        total, n = total + step_s, n + 1
    return n


@dataclass(frozen=True)
class Settings:
    """Numbers of the paper's table 3, at the sample rates of accelerometer and magnetometer.

    Covariances of the bias are in units of the measurement variance at rest, so that one may be
    told from the other at any rate.
    """

    rate_hz: float = 100.0
    mag_rate_hz: float = 100.0
    magnetic: bool = True
    acc_tau_s: float = 3.0
    mag_tau_s: float = 9.0

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("rate_hz", self.rate_hz, 10.0, 4000.0),
            ("mag_rate_hz", self.mag_rate_hz, 1.0, self.rate_hz),
            ("acc_tau_s", self.acc_tau_s, 0.5, 30.0),
            ("mag_tau_s", self.mag_tau_s, 0.5, 100.0),
        ):
            if not low <= value <= high:
                raise InputError.at(
                    f"vqf, {name}",
                    wanted=f"{low:g} to {high:g}",
                    found=f"{value:g}",
                    fix="choose a value inside the range",
                )

    @property
    def step_s(self) -> float:
        """Ts of gyro and accelerometer."""
        return 1.0 / self.rate_hz

    @property
    def mag_step_s(self) -> float:
        """Ts of the magnetometer."""
        return 1.0 / self.mag_rate_hz

    @cached_property
    def vertical(self) -> LowPass:
        """Low-pass of the specific force, and of the values compared with it."""
        return LowPass(self.acc_tau_s, self.step_s)

    @cached_property
    def rest(self) -> LowPass:
        """Low-pass of gyro and accelerometer for the detection of rest."""
        return LowPass(0.5, self.step_s)

    @cached_property
    def field(self) -> LowPass:
        """Low-pass of the field's norm and dip."""
        return LowPass(0.05, self.mag_step_s)

    # -- samples ------------------------------------------------------------------------------

    @cached_property
    def rest_samples(self) -> int:
        """Still samples that make rest: 1.5 s."""
        return _samples_until(1.5, self.step_s)

    @cached_property
    def calm_samples(self) -> int:
        """Samples near the reference that end a disturbance: 0.5 s."""
        return _samples_until(0.5, self.mag_step_s)

    @cached_property
    def candidate_samples(self) -> tuple[int, int]:
        """Turning samples that accept a new field: the first one 5 s, another one 20 s."""
        return _samples_until(5.0, self.mag_step_s), _samples_until(20.0, self.mag_step_s)

    @cached_property
    def rejected_samples(self) -> int:
        """Disturbed samples after which the field is followed again: 60 s, the largest sum."""
        return _samples_until(math.nextafter(60.0, 61.0), self.mag_step_s) - 1

    @property
    def patience(self) -> float:
        """Samples that may yet be rejected when none was: a power of two, at which it stops."""
        return counter_limit(self.rejected_samples + 1.0)

    @property
    def impatient(self) -> float:
        """Patience left when the field is followed again, minus half a sample."""
        return self.patience - self.rejected_samples - 0.5

    @cached_property
    def first_samples(self) -> int:
        """Magnetometer samples of gain 1/n or more, until tau/(n + 1) is below a step.

        1/n is summed up as the filter's authors do, k <- k/(k + 1), whose last bit may decide.
        """
        gain, n = 0.5, 1
        while gain * self.mag_tau_s >= self.mag_step_s:
            gain, n = gain / (gain + 1.0), n + 1
        return n

    # -- gains --------------------------------------------------------------------------------

    @property
    def mag_gain(self) -> float:
        """k_mag."""
        return gain_of(self.mag_tau_s, self.mag_step_s)

    @property
    def field_gain(self) -> float:
        """Gain at which reference and candidate of the field follow it: 20 s."""
        return gain_of(20.0, self.mag_step_s)

    # -- covariances, (0.01 deg/s)^2 ------------------------------------------------------------

    @property
    def _growth(self) -> float:
        """V: from 0 to (0.1 deg/s)^2 in 100 s."""
        return 100.0 * self.step_s / 100.0

    def _noise(self, steady: float) -> float:
        """Measurement variance at which P settles at ``steady``: P^2/V + P."""
        return steady * steady / self._growth + steady

    @property
    def start_variance(self) -> float:
        """P0, of 0.5 deg/s, in units of the variance at rest (0.03 deg/s)."""
        return 2500.0 / self._noise(9.0)

    @property
    def growth(self) -> float:
        """V in those units."""
        return self._growth / self._noise(9.0)

    @property
    def motion_weight(self) -> float:
        """Variance at rest over that in motion, of 0.1 deg/s."""
        return self._noise(9.0) / self._noise(100.0)
