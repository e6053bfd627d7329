"""What every estimator must do: one body, and rows of bounds.

What an estimator computes, and what it alone does, is in the tests of its own room.
"""

from __future__ import annotations

import math
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from boresight.model.attitude.mekf import Mekf
from boresight.model.attitude.vqf import Settings, Vqf
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.experiment import Array
from boresight.systems.array.world import TurningArray
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.phases import Array as LinearArray
from boresight.systems.mls.phases import ArrayPhases
from boresight.systems.mls.world import Landing, deck
from boresight.systems.radar.estimator import Registration
from boresight.systems.radar.world import TwoRadars
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.world import OnTheMove
from tests.support import exact_sensors
from tests.support.estimators import ALL, core_of
from tests.support.exact_sensors import apart, at_rest, bits, sphere

NAN = math.nan

# -- what is refused ------------------------------------------------------------------------------

#: What is made, how its messages begin; an option, its value, and what the message goes on with.
OPTIONS: dict[tuple[Any, str], list[tuple[str, Any, str]]] = {
    (Mekf, "mekf, "): [("mag", "some", "mag: wanted one of full, none, found 'some'")],
    (Vqf, "vqf, "): [("mag", "all", "mag: wanted one of full, none, found 'all'")],
    (Settings, "vqf, "): [
        ("rate_hz", 5.0, "rate_hz: wanted 10 to 4000, found 5"),
        ("mag_rate_hz", 101.0, "mag_rate_hz: wanted 1 to 100, found 101"),
        ("acc_tau_s", NAN, "acc_tau_s: wanted 0.5 to 30, found nan"),
        ("mag_tau_s", 0.1, "mag_tau_s: wanted 0.5 to 100, found 0.1"),
    ],
    (Satcom, "satcom, "): [
        ("roll", "mirrored", "roll: wanted one of corrected, printed, found"),
        ("detector", "none", "detector: wanted one of"),
    ],
    (MlsAttitude, "mls_attitude, "): [
        ("picard", 5, "picard: wanted one of 3, 4, found 5"),
        ("norm", "one", "norm: wanted one of set, free, found 'one'"),
        ("process", "new", "process: wanted one of corrected, printed, found 'new'"),
        ("order", 3, "order: wanted one of picard, process, .*found 'order'"),
    ],
    (ArrayPhases, "array_phases, "): [
        ("elements", n, "elements: wanted 2 to 160") for n in (0, 1, 161, 8.0, "64")
    ],
    (Registration, "registration, "): [
        ("site_1", (115.0, 89.5, 0.0), "site_1, latitude: wanted -89 to 89, found 89.5"),
        ("site_2", (190.0, 30.0, 0.0), "site_2, longitude: wanted -180 to 180"),
        ("site_2", (1.0, 3.0, -900.0), "site_2, height: wanted -500 to 20000"),
        ("site_2", (1.0, 3.0), "site_2: wanted"),
        ("site_2", "abc", "site_2: wanted"),
        ("site_1", (115.74, 29.43, NAN), "site_1, height"),
        ("site_2", (115.74, 29.430001, 5.0), "sites: wanted radars a metre apart or more"),
    ],
    (ArrayAttitude, "array_attitude, "): [
        ("latitude", 89.5, "latitude: wanted -89 to 89, found 89.5"),
        ("latitude", NAN, "latitude"),
        ("height", 20e3, "height: wanted -500 to 10000"),
        ("attitude", (1.0, 2.0, 400.0), "heading: wanted -360 to 360"),
        ("attitude", (1.0, 2.0), "attitude: wanted"),
        ("reading", "none", "reading: wanted heading or literal, found 'none'"),
        ("rate", 10.0, "rate: wanted 50 to 1000"),
        ("align", 10.0, "align: wanted 30 to 300, or 0"),
    ],
    # worlds, what they are made of, an experiment
    (Landing, ""): [
        ("azimuth_deg", 70.0, "landing, azimuth_deg: wanted -62 to 62, found 70.0"),
        ("elevation_deg", 60.0, "landing, elevation_deg: wanted -1.5 to 29.5, found 60.0"),
        ("beams", 2, "landing, beams: wanted 8 or more, found 2"),
        ("spacing", 0.0, "array, spacing: wanted wavelengths above 0"),
        ("motion", "storm", "motion: wanted one of"),
    ],
    (partial(deck, seconds=1.0, seed=1), ""): [
        ("name", "sea_9", "motion: wanted one of table, rolling, sea_3")
    ],
    (LinearArray, "array, "): [
        ("elements", 1, "elements: wanted 2 or more, found 1"),
        ("spacing", 0.0, "spacing: wanted wavelengths above 0, found 0.0"),
        ("spacing", NAN, "spacing: wanted wavelengths above 0, found nan"),
    ],
    (TwoRadars, "two_radars, "): [
        ("dt", 0.0, "dt: wanted 0.01 to 1 s, found 0.0"),
        ("seconds", 0.01, "seconds: wanted"),
        ("noise", -1.0, "noise: wanted 0 or more"),
        ("missed", 1.0, "missed: wanted a share below 1"),
        ("bias", (1.0,), "bias and noises: wanted six"),
        ("sites", ((0, 0, 0),), "sites: wanted two radars"),
    ],
    (TurningArray, "turning_array, "): [
        ("deg_s", 0.0, "deg_s: wanted above 0, to 44, found 0.0"),
        ("deg_s", 45.0, "deg_s: wanted above 0"),
        ("hours", 0.0, "hours: wanted above 0, to 100"),
        ("errors", -1.0, "errors: wanted 0 or more"),
        ("noise", -1.0, "noise: wanted 0 or more"),
        ("tilt_deg", 21.0, "tilt_deg: wanted 0 to 20"),
        ("counts_bits", 12, "counts_bits: wanted 16 to 48"),
    ],
    (Array, "experiment array, "): [
        ("hours", hours, "hours: wanted 1 to 24, found") for hours in (0.5, 25.0)
    ],
    (OnTheMove, "drive: "): [
        ("on", "rail", "wanted one of specification, rough, city, found 'rail'")
    ],
    (OnTheMove, "drive, rate_hz: wanted 10 to 1000 Hz, "): [
        ("rate_hz", 0.0, "found 0.0"),
        ("rate_hz", NAN, "found nan"),
    ],
    (OnTheMove, "on_the_move, "): [
        ("tracking_hz", 60.0, "tracking_hz: wanted 0 to 50 Hz, found 60.0"),
        ("tracking_hz", NAN, "tracking_hz: wanted 0 to 50 Hz, found nan"),
        ("beam", "roll", "beam: wanted heading or heading_pi, found 'roll'"),
        ("place", (34.0, 0.0, 110.0), "place: wanted a satellite above the horizon, found -"),
        ("place", (91.0, 110.0, 110.0), "place: wanted up to 90 deg of latitude, 180"),
        ("place", (34.0, 181.0, 181.0), "place: wanted up to 90 deg of latitude, 180"),
        ("place", (NAN, 0.0, 0.0), "place: wanted up to 90 deg of latitude, 180"),
    ],
}


@pytest.mark.parametrize("make, subject", OPTIONS)
def test_options_are_refused_in_one_line(make: Any, subject: str) -> None:
    for option, value, message in OPTIONS[make, subject]:
        with pytest.raises(InputError, match=f"^{subject}{message}") as caught:
            make(**{option: value})
        assert "\n" not in str(caught.value)


#: Values that no edit of a declared range may make legal: they divide by zero, or saturate.
ILLEGAL: dict[str, dict[str, tuple[float, ...]]] = {
    "ekf_bias": {
        **dict.fromkeys(("p0_sd", "gyro_density", "acc_sd", "mag_sd", "mag_gate"), (0.0,)),
        **{"bias_p0_sd": (0.0, 0.3), "bias_density": (-1e-9,), "acc_sd_per_g": (-0.1,)},
        **{"mag_rate_per_s": (-1.0,), "scale": (0.5,)},
    },
    "mekf": {
        **dict.fromkeys(("tilt_var", "heading_var", "gyro_var", "bias_var"), (0.0,)),
        **{"start_var": (-1.0,), "p0_bias": (1.0,), "force_rate_per_s": (0.0,)},
        **{"update_s": (-0.1,), "field_min_sq": (0.0,)},
    },
    **{
        name: {"scale": (0.0, 2000.0), "acc_max_sq": (0.0,), "acc_min_sq": (-1.0,)}
        | {"mag_min_sq": (0.0,), noise: (0.0, -1.0, 1e9)}
        for name, noise in (("ekf_quaternion", "angle_sd_x"),)
    },
    "array_attitude": {"start_qz": (3.0,), "p0_tilt": (-0.5,)},
    "array_phases": {"spacing": (0.0,)},
}


@pytest.mark.parametrize("name", ALL)
def test_values_out_of_range_are_refused_with_the_range(name: str) -> None:
    e = ALL[name]()
    for p in e.params:
        for value in (*ILLEGAL.get(name, {}).get(p.name, ()), NAN, math.inf, 2 * abs(p.high) + 1):
            with pytest.raises(InputError, match=rf"^parameter {p.name}: .* to "):
                e.param_values({p.name: value})
    assert not ILLEGAL.get(name, {}).keys() - {p.name for p in e.params}


# -- cycles, status bits --------------------------------------------------------------------------

#: Cycles of one update, and those to the last urgent output (0: no output is urgent).
CYCLES = [
    ("complementary", "small", 347, 261),
    ("complementary", "fast", 207, 168),
    ("ma2014_cf", "small", 369, 296),
    ("ma2014_cf", "fast", 289, 245),
    ("ekf_bias", "small", 1128, 598),
    ("ekf_bias", "fast", 577, 450),
    ("ekf_quaternion", "small", 717, 503),
    ("ekf_quaternion", "fast", 385, 322),
    ("mekf", "small", 782, 475),
    ("mekf", "fast", 409, 363),
    ("vqf", "small", 1019, 514),
    ("vqf", "fast", 579, 468),
    ("array_attitude", "small", 1927, 138),
    ("array_attitude", "fast", 988, 112),
    ("array_phases", "small", 141, 132),
    ("array_phases", "fast", 101, 101),
    ("battery", "small", 275, 275),
    ("battery", "fast", 257, 257),
    ("ekf2", "small-2048", 2910, 109),
    ("ekf2", "fast-2048", 1466, 79),
    ("ins_gnss", "small-1024", 2912, 116),
    ("ins_gnss", "fast-1024", 1473, 78),
    ("mls_attitude", "small", 707, 600),
    ("mls_attitude", "fast", 502, 480),
    ("pmsm", "small", 266, 138),
    ("pmsm", "fast", 170, 124),
    ("registration", "small", 1326, 989),
    ("registration", "fast", 687, 611),
    ("satcom", "small", 997, 665),
    ("satcom", "fast", 511, 489),
    ("satcom_pointing", "small", 262, 262),
    ("satcom_pointing", "fast", 239, 239),
    ("calibrate_inertial", "small", 54, 0),
    ("calibrate_inertial", "fast", 49, 0),
    ("calibrate_field", "small", 27, 27),
    ("calibrate_field", "fast", 22, 22),
    ("compass_field", "small", 87, 87),
    ("compass_field", "fast", 65, 65),
]


@pytest.mark.parametrize("name, config, interval, latency", CYCLES)
def test_cycles(name: str, config: str, interval: int, latency: int) -> None:
    schedule = core_of(name, config).schedule
    assert schedule.interval <= interval
    assert schedule.latency <= latency


#: Numbers of the status bits that each filter sets.
STATUS = {
    "complementary": "01234567",
    "mekf": "0123456",
    "vqf": "012345",
    "ekf_bias": "0134",
    "ekf_quaternion": "023",
    "mls_attitude": "01",
    "satcom": "0123",
    "registration": "012345",
    "array_attitude": "012345678",
}


@pytest.mark.parametrize("name", STATUS)
def test_every_status_bit_is_documented(name: str) -> None:
    meanings = ALL[name]().status_bits
    assert "".join(map(str, sorted(meanings))) == STATUS[name] and all(meanings.values())


# -- filters of nine axes: any attitude, the furthest restart, fixed point on a recording ---------

#: Time step [s], field [uT], samples until it is surely aligned; samples after which a restart half
#: a turn away is forgotten, and the error [deg] then.
SETTING = {
    "complementary": (0.05, (0.0, 27.9, -46.2), 2, 2, 1e-5),
    "ekf_bias": (0.01, (0.0, 18.0, -45.0), 18, 60, 0.05),
    "ekf_quaternion": (0.01, (0.0, 14.7, -40.6), 6, 30, 1e-3),
    "mekf": (0.01, (0.0, 18.0, -40.0), 0, 0, 1e-4),
    "vqf": (0.01, (0.0, 18.0, -40.0), 0, 1, 1e-4),
}
#: Largest error [deg] from then on, in float64 and at each width; there never less than a tenth.
ALIGNED = [
    ("complementary", "float", 1e-12),
    ("complementary", 32, 2e-5),
    ("complementary", 28, 5e-4),
    ("complementary", 24, 5e-3),
    ("complementary", 20, 0.2),
    ("complementary", 18, 0.12),
    ("ekf_bias", "float", 0.05),
    ("ekf_bias", 32, 0.05),
    ("ekf_quaternion", "float", 2e-13),
    ("ekf_quaternion", 32, 1e-5),
    ("mekf", "float", 2e-13),
    ("mekf", 32, 2e-5),
    ("vqf", "float", 5e-4),
    ("vqf", 32, 5e-4),
]
ANGLES = ((-180.0, -90.0, -45.0, 0.0, 135.0), (-180.0, -100.0, 0.0, 60.0, 179.9))
#: Attitudes all over the sphere; Euler angles keep away from the vertical.
GRID = sphere((-90.0, -60.0, 0.0, 30.0, 89.9), *ANGLES)
EULER_GRID = sphere((-84.9, -60.0, 0.0, 30.0, 84.9), *ANGLES)


@cache
def made(name: str) -> Estimator:
    return ALL[name]()


def run(e: Estimator, x: Any, word: int | str) -> Any:
    """Outputs by name, (steps, runs)."""
    return (
        exact_sensors.run_float(e, x)
        if word == "float"
        else exact_sensors.run_fixed(e, x, word=int(word))
    )


@pytest.mark.parametrize("name, word, bound", ALIGNED)
def test_aligns_at_any_attitude(name: str, word: int | str, bound: float) -> None:
    dt, field, aligned, *_ = SETTING[name]
    q = EULER_GRID if name == "complementary" else GRID
    out = run(made(name), at_rest(q, aligned + 3, dt, field), word)
    error = apart(out, q)[aligned:].max()
    assert error < bound and (word == "float" or error > 0.1 * bound)
    status = bits(out) & ~16  # a field counts as odd until it is known
    assert not status[aligned:].any() and (aligned == 0 or (status[0] & 1).all())


@pytest.mark.parametrize("word", ["float", 32])
@pytest.mark.parametrize("name", SETTING)
def test_restart_exactly_half_a_turn_away(name: str, word: int | str) -> None:
    """Level, then upside down about each axis, to the last bit: no axis and no sign to go by."""
    dt, field, _, after, bound = SETTING[name]
    level, turned = np.eye(4)[[0, 0, 0]], np.eye(4)[1:]
    x = np.concatenate([at_rest(level, 20, dt, field), at_rest(turned, after + 1, dt, field)])
    x[np.abs(x) < 1e-9] = 0.0
    x[20, 0] = -0.25
    out = run(made(name), x, word)
    assert apart(out, turned)[-1].max() < bound
    assert not bits(out)[-1].any() or name == "vqf"


#: Samples of the recording; largest difference [deg] to float64, never less than a thousandth.
RECORDED = {"mekf": (4000, 5e-4), "ekf_bias": (2000, 0.005)}


@pytest.mark.parametrize("name", RECORDED)
def test_fixed_point_is_float64_on_a_recording(name: str) -> None:
    """Every status bit the same, and nothing saturates."""
    e, (steps, bound) = made(name), RECORDED[name]
    x = feed(e, read_record(bundled("ximu_walk"))).inputs[:steps, :, None]
    fixed = exact_sensors.run_fixed(e, x)
    floating = exact_sensors.run_float(e, x)
    error = apart(fixed, exact_sensors.attitude_of(floating))
    assert 1e-3 * bound < error.max() < bound
    assert np.array_equal(fixed["status"], floating["status"])
    for angle in ("pitch", "roll", "heading"):
        off = np.abs((fixed[angle] - floating[angle] + 1.0) % 2.0 - 1.0) * 180.0
        assert np.quantile(off, 0.99) < 2.0 * bound
