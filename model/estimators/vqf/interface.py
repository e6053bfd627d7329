"""What `Vqf` is built for, reads, keeps and tells: settings, inputs, states, parameters, status."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from boresight.model import ops
from boresight.model.algebra.low_pass import LowPass, gain_of
from boresight.model.declarations import Input, Param, State
from boresight.model.errors import InputError
from boresight.model.estimators.nine_axis import INPUTS

__all__ = [
    "CLIP_RAD_S",
    "DEGREE",
    "START",
    "STATUS_BITS",
    "Settings",
    "counted",
    "counter_limit",
    "interface_of",
]

DEGREE = math.pi / 180.0
CLIP_RAD_S = 2.0 * DEGREE  #: largest bias, and unit of the states that hold it.

BELOW_ONE = 1.0 - 2.0**-31
START = (BELOW_ONE, 0.0, 0.0, 0.0)  #: attitude at the start; its norm is mended at once.

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "aligning: no specific force so far",
    1: "heading not aligned: no magnetometer sample so far",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field disturbed: the heading follows the gyro",
    5: "at rest: the gyro's bias is measured",
}

_FORCE_MOST = 278.0  # m/s^2, three components of 160
_RATE_MOST = 40.0  # rad/s
_FIELD_MOST = 444.0  # uT, three components of 256


def counter_limit(samples: float) -> float:
    """Where a counter that must reach ``samples`` stops: a power of two, which costs nothing."""
    return 2.0 ** math.ceil(math.log2(samples + 1.0))


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
        """Low-pass of the specific force, and of what is compared with it."""
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
        n = _samples_until(60.0, self.mag_step_s)
        total = 0.0
        for _ in range(n):
            total += self.mag_step_s
        return n if total <= 60.0 else n - 1

    @property
    def patience(self) -> float:
        """Samples that may yet be rejected when none was: a power of two, at which it stops."""
        return counter_limit(self.rejected_samples + 1.0)

    @property
    def impatient(self) -> float:
        """What is left of it when the field is followed again, and half a sample less."""
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


def interface_of(
    settings: Settings,
) -> tuple[tuple[Input, ...], tuple[Param, ...], tuple[State, ...]]:
    """Inputs, parameters and states."""
    return _inputs(settings), _params(settings), _states(settings)


def _inputs(settings: Settings) -> tuple[Input, ...]:
    """Inputs of all attitude filters, or without the magnetometer."""
    return INPUTS if settings.magnetic else tuple(i for i in INPUTS if i.name[0] != "m")


def _params(settings: Settings) -> tuple[Param, ...]:
    """Thresholds and gains that may be written while the filter runs."""
    rest = (
        Param(
            "rest_gyr",
            2.0 * DEGREE,
            0.0,
            0.5,
            "rad/s",
            "least deviation from the mean rate in motion",
        ),
        Param("rest_acc", 0.5, 0.0, 0.9, "m/s^2", "least deviation from the mean force in motion"),
    )
    if not settings.magnetic:
        return rest
    return (
        *rest,
        Param(
            "mag_gain",
            settings.mag_gain,
            0.0,
            1.0,
            "",
            "share of the heading's error that a sample corrects",
        ),
        Param(
            "field_gain",
            gain_of(20.0, settings.mag_step_s),
            0.0,
            1.0,
            "",
            "share of the field that reference and candidate take over at a sample",
        ),
        Param(
            "norm_share",
            0.1,
            0.0,
            1.0,
            "",
            "least deviation of a disturbed field, of the reference's norm",
        ),
        Param(
            "dip_limit", 10.0 / 180.0, 0.0, 1.0, "ht", "least deviation of a disturbed field's dip"
        ),
    )


def _channels(low_pass: LowPass, name: str, parts: str, largest: float, unit: str) -> list[State]:
    """States of a low-pass, by channel."""
    _, z, v = (c * largest for c in low_pass.largest)
    return [
        State(f"{name}_{kind}_{part}".rstrip("_"), -most, most, unit)
        for part in parts.split()
        for kind, most in (("z", z), ("v", v))
    ]


def _states(settings: Settings) -> tuple[State, ...]:
    """Everything that is carried from sample to sample."""
    p0 = settings.start_variance
    most = p0 + settings.growth
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    states = [
        *(State(f"q{a}", -1.0, BELOW_ONE, "", v) for a, v in zip("wxyz", START, strict=True)),
        *(State(f"bias_{a}", -1.0, BELOW_ONE, "") for a in "xyz"),
        *(
            State(f"p{i}{j}", 0.0 if i == j else -most, most, "", p0 if i == j else 0.0)
            for i, j in pairs
        ),
        *_channels(settings.rest, "gyr", "x y z", _RATE_MOST, "rad/s"),
        *_channels(settings.rest, "acc", "x y z", 160.0, "m/s^2"),
        *_channels(settings.vertical, "up", "e n u", _FORCE_MOST, "m/s^2"),
        *_channels(settings.vertical, "c", "ex ey ez nx ny nz ux uy uz", 1.0, ""),
        *_channels(settings.vertical, "b", "e n", math.sqrt(3.0), ""),
        State("count", 0.0, counter_limit(settings.vertical.mean_samples), ""),
        State("still", 0.0, counter_limit(settings.rest_samples), ""),
    ]
    if settings.magnetic:
        norm, most = 2.0 * _FIELD_MOST, settings.patience
        states += [
            State("delta", -1.0, 1.0, "ht"),  # heading of the frame in which the force is averaged
            *_channels(settings.field, "norm", "_", _FIELD_MOST, "uT"),
            *_channels(settings.field, "dip", "_", 0.5, "ht"),
            State("ref_norm", -1.0, norm, "uT"),
            State("ref_dip", -1.0, 1.0, "ht"),
            State("new_norm", -1.0, norm, "uT", -1.0),
            State("new_dip", -1.0, 1.0, "ht"),
            State("new_turning", 0.0, counter_limit(settings.candidate_samples[1]), ""),
            State("calm", 0.0, counter_limit(settings.calm_samples), ""),
            State("patience", 0.0, most, "", most - settings.rejected_samples),
            State("mag_count", 0.0, counter_limit(settings.first_samples), ""),
        ]
    return tuple(states)
