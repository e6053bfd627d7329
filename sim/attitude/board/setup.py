"""Speeds and times of a simulated board: real, or all scaled."""

from __future__ import annotations

from dataclasses import dataclass, replace

#: Factor by which `SCALED` and `FAULTY` are faster than the real board.
FASTER = 16


@dataclass(frozen=True)
class Setup:
    """Parameters of the system, and speeds of the devices at its pins.

    Attributes
    ----------
    clock_hz : int
        Clock of the system.
    host_baud, hmr_baud : int
        Serial lines, bits per second.
    sclk_hz, stall_s : float
        SPI clock, and pause between frames.
    startup_s, reset_s : float
        Wait after the reset of the ADIS16385, and the length of that reset.
    self_test_s : float
        Wait for its self-test.
    rate_hz, lines_hz : int
        Samples and compass lines a second.
    ready_cycles : int
        Length of the data-ready pulse.
    compass_start_cycles : int
        From power-up to the compass's first line.
    ppm : int
        Error of the ADIS16385's clock; positive: fast.
    """

    clock_hz: int = 70_000_000
    host_baud: int = 921_600
    hmr_baud: int = 19_200
    sclk_hz: float = 1e6
    stall_s: float = 16e-6
    startup_s: float = 0.3
    reset_s: float = 1e-3
    self_test_s: float = 0.05
    rate_hz: int = 1024
    lines_hz: int = 8
    ready_cycles: int = 5_000
    compass_start_cycles: int = 80_000_000
    ppm: int = 0

    @property
    def period_cycles(self) -> float:
        """Cycles from sample to sample."""
        return self.clock_hz / self.rate_hz


#: As on the bench, but with short waits after power-up.
REAL = Setup(startup_s=2e-3, self_test_s=1e-3, compass_start_cycles=1_000_000)

#: Sixteen times as fast, at 100 MHz, so that 500 samples take 3 million cycles.
SCALED = Setup(
    clock_hz=100_000_000,
    host_baud=12_500_000,
    hmr_baud=307_200,
    sclk_hz=10e6,
    stall_s=1e-6,
    startup_s=0.3e-3,
    reset_s=50e-6,
    self_test_s=0.1e-3,
    rate_hz=16_384,
    lines_hz=128,
    ready_cycles=200,
    compass_start_cycles=60_000,
)

#: The same with all waits of the bench, sixteen times as fast.
FAULTY = replace(SCALED, startup_s=0.3 / FASTER, reset_s=1e-3 / FASTER)
