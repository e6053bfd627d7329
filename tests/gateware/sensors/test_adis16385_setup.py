"""Times, settings and limits of the reader: the defaults, and what is refused."""

import pytest

from boresight.gateware.sensors.adis16385_frames import COMM_FAILURE
from boresight.gateware.sensors.adis16385_setup import Settings, Timing


@pytest.mark.parametrize(
    "given, message",
    [
        ({"identity": 0x10000}, r"^identity must be an integer from 0 to 65535, not 65536$"),
        ({"sens_avg": -1}, r"^sens_avg must be an integer from 0 to 65535, not -1$"),
        ({"gyro_limit": 0}, r"^gyro_limit must be an integer from 1 to 32767, not 0$"),
        ({"bad_limit": 17}, r"^bad_limit must be an integer from 1 to 16, not 17$"),
        ({"bad_limit": True}, r"^bad_limit must be an integer from 1 to 16, not True$"),
        ({"sclk_hz": 0}, r"^sclk_hz must be a positive number, not 0$"),
        ({"timeout_periods": 0.5}, r"^timeout_periods must be 1 or more, not 0\.5$"),
        ({"timeout_periods": float("nan")}, r"^timeout_periods must be 1 or more, not nan$"),
        ({"accel_limit": 0x8000}, r"^accel_limit must be an integer from 1 to 32767, not 32768$"),
        ({"bad_limit": 0}, r"^bad_limit must be an integer from 1 to 16, not 0$"),
        ({"sclk_hz": True}, r"^sclk_hz must be a positive number, not True$"),
    ],
)
def test_values_are_checked(given, message: str) -> None:
    kind = Timing if given.keys() <= vars(Timing()).keys() else Settings
    with pytest.raises(ValueError, match=message):
        kind(**given)


def test_the_ends_of_the_ranges() -> None:
    Timing(timeout_periods=1.0, sclk_hz=1e-3)
    for limit in (1, 0x7FFF):
        Settings(gyro_limit=limit, accel_limit=limit)
    Settings(identity=0xFFFF, sens_avg=0, bad_limit=16)
    Settings(bad_limit=1)


def test_what_stops_a_sample_is_an_alarm_too_and_one_bit_is_neither() -> None:
    settings = Settings()
    assert settings.invalid_mask == COMM_FAILURE
    assert settings.alarm_mask & settings.invalid_mask == settings.invalid_mask
    assert settings.alarm_mask == 0xFFFF ^ 1 << 7
    assert Timing().period_s == 1 / 1024 and (settings.gyro_limit, settings.accel_limit) == (
        24_000,
        20_000,
    )
