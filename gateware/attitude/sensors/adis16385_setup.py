"""Parameters of an `Adis16385`: times of the device, its settings, limits of the checks."""

from __future__ import annotations

from dataclasses import dataclass

from boresight.gateware.attitude.sensors.adis16385_frames import COMM_FAILURE, IDENTITY


@dataclass(frozen=True)
class Timing:
    """Times of the device.

    Parameters
    ----------
    sclk_hz : float
        Highest SPI clock, Hz. 1 MHz is what the maker's own tool uses.
    stall_s : float
        Least pause between frames, s. 16 us is what the maker's own tool uses.
    startup_s : float
        Least wait from the end of the reset pulse to the first frame, s (unverified: 0.3).
    reset_s : float
        Least length of the reset pulse, s (unverified: 1 ms).
    period_s : float
        Nominal time between samples without decimation, s: 1/1024.
    timeout_periods : float
        Periods after which a data-ready edge counts as missing.
    """

    sclk_hz: float = 1e6
    stall_s: float = 16e-6
    startup_s: float = 0.3
    reset_s: float = 1e-3
    period_s: float = 1 / 1024
    timeout_periods: float = 4.0

    def __post_init__(self) -> None:
        for name, value, minimum in (
            ("sclk_hz", self.sclk_hz, 0.0),
            ("timeout_periods", self.timeout_periods, 1.0),
        ):
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not value >= minimum or not value > 0:
                wanted = "1 or more" if minimum else "a positive number"
                raise ValueError(f"{name} must be {wanted}, not {value!r}")


@dataclass(frozen=True)
class Settings:
    """Words of the device, and limits of the reader's checks.

    Parameters
    ----------
    bad_limit : int, 1 to 16
        Bad samples in a row that lead to a new start.
    identity : int
        PROD_ID.
    msc_ctrl, smpl_prd, sens_avg : int
        Settings while the members of the same names are not driven: data-ready on DIO1, active
        high; 1024 samples/s; +-300 deg/s and a filter of 2**2 taps per stage.
    gyro_limit, accel_limit : int
        Full scale, counts: a magnitude from there on is over-range.
    alarm_mask, invalid_mask : int
        Bits of DIAG_STAT.
    """

    bad_limit: int = 4
    identity: int = IDENTITY
    msc_ctrl: int = 0x0006
    smpl_prd: int = 0x0001
    sens_avg: int = 0x0402
    gyro_limit: int = 24_000
    accel_limit: int = 20_000
    alarm_mask: int = 0xFF7F
    invalid_mask: int = COMM_FAILURE

    def __post_init__(self) -> None:
        limits = {"gyro_limit": (1, 0x7FFF), "accel_limit": (1, 0x7FFF), "bad_limit": (1, 16)}
        for name, value in vars(self).items():
            low, high = limits.get(name, (0, 0xFFFF))
            if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
                raise ValueError(f"{name} must be an integer from {low} to {high}, not {value!r}")
