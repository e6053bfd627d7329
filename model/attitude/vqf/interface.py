"""Interface of a `Vqf`: inputs, parameters, states, status bits."""

from __future__ import annotations

from boresight.model.algebra.low_pass import LowPass
from boresight.model.attitude.table import params_of
from boresight.model.attitude.vqf.settings import (
    ACC_MOST,
    DEGREE,
    FIELD_MOST,
    FORCE_MOST,
    RATE_MOST,
    ROOT_3,
    Settings,
    counter_limit,
)
from boresight.model.declarations import Input, Param, State
from boresight.model.nine_axis import INPUTS

BELOW_ONE = 1.0 - 2.0**-31
START = (BELOW_ONE, 0.0, 0.0, 0.0)  #: attitude at the start; its norm is mended at once.

#: Bits of the output ``status``.
STATUS_BITS = {
    0: "no attitude yet: no specific force so far",
    1: "heading not aligned: no magnetometer sample so far, or a field along the vertical",
    2: "accelerometer not used: no specific force",
    3: "no magnetometer sample",
    4: "field disturbed: the heading follows the gyro",
    5: "at rest: the gyro's bias is measured",
}


def interface_of(
    settings: Settings,
) -> tuple[tuple[Input, ...], tuple[Param, ...], tuple[State, ...]]:
    """Inputs, parameters that may be written while the filter runs, and states."""
    inputs = INPUTS if settings.magnetic else tuple(i for i in INPUTS if i.name[0] != "m")
    return inputs, _params(settings), _states(settings)


def _params(settings: Settings) -> tuple[Param, ...]:
    """Thresholds and gains."""
    of_rest = f"""
        rest_gyr {2.0 * DEGREE!r} 0 0.5 rad/s
            least deviation from the mean rate in motion
        rest_acc 0.5 0 0.9 m/s^2
            least deviation from the mean force in motion
    """
    of_field = f"""
        mag_gain {settings.mag_gain!r} 0 1 -
            share of the heading's error that a sample corrects
        field_gain {settings.field_gain!r} 0 1 -
            share of the field that reference and candidate take over at a sample
        norm_share 0.1 0 1 -
            least deviation of a disturbed field, of the reference's norm
        dip_limit {10.0 / 180.0!r} 0 1 ht
            least deviation of a disturbed field's dip
    """
    return params_of(of_rest) + (params_of(of_field) if settings.magnetic else ())


def _channels(low_pass: LowPass, name: str, parts: str, largest: float, unit: str) -> list[State]:
    """States of a low-pass, by channel."""
    _, z, v = (c * largest for c in low_pass.largest)
    return [
        State(f"{name}_{kind}_{part}".rstrip("_"), -bound, bound, unit)
        for part in parts.split()
        for kind, bound in (("z", z), ("v", v))
    ]


def _states(settings: Settings) -> tuple[State, ...]:
    """Everything that is carried from sample to sample."""
    p0 = settings.start_variance
    bound = p0 + settings.growth
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    states = [
        *(State(f"q{a}", -1.0, BELOW_ONE, "", v) for a, v in zip("wxyz", START, strict=True)),
        *(State(f"bias_{a}", -1.0, BELOW_ONE, "") for a in "xyz"),
        *(
            State(f"p{i}{j}", 0.0 if i == j else -bound, bound, "", p0 if i == j else 0.0)
            for i, j in pairs
        ),
        *_channels(settings.rest, "gyr", "x y z", RATE_MOST, "rad/s"),
        *_channels(settings.rest, "acc", "x y z", ACC_MOST, "m/s^2"),
        *_channels(settings.vertical, "up", "e n u", FORCE_MOST, "m/s^2"),
        *_channels(settings.vertical, "c", "ex ey ez nx ny nz ux uy uz", 1.0, ""),
        *_channels(settings.vertical, "b", "e n", ROOT_3, ""),
        State("count", 0.0, counter_limit(settings.vertical.mean_samples), ""),
        State("still", 0.0, counter_limit(settings.rest_samples), ""),
    ]
    if settings.magnetic:
        norm, bound = 2.0 * FIELD_MOST, settings.patience
        states += [
            State("delta", -1.0, 1.0, "ht"),  # heading of the frame in which the force is averaged
            *_channels(settings.field, "norm", "_", FIELD_MOST, "uT"),
            *_channels(settings.field, "dip", "_", 0.5, "ht"),
            State("ref_norm", -1.0, norm, "uT"),
            State("ref_dip", -1.0, 1.0, "ht"),
            State("new_norm", -1.0, norm, "uT", -1.0),
            State("new_dip", -1.0, 1.0, "ht"),
            State("new_turning", 0.0, counter_limit(settings.candidate_samples[1]), ""),
            State("calm", 0.0, counter_limit(settings.calm_samples), ""),
            State("patience", 0.0, bound, "", bound - settings.rejected_samples),
            State("mag_count", 0.0, counter_limit(settings.first_samples), ""),
        ]
    return tuple(states)
