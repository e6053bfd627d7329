"""Clock of the core on a board with an iCE40: the oscillator itself, or a PLL's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from amaranth.hdl import ClockDomain, ClockSignal, Const, Instance, Module, ResetSignal, Signal
from amaranth.lib.cdc import FFSynchronizer

from boresight.gateware.boards.clock import Clock
from boresight.model.errors import InputError

#: Legal frequencies of the oscillator inside the PLL, and of the clock behind the divider of its
#: input, Hz (data sheet FPGA-DS-02008).
VCO_HZ = (533_000_000, 1_066_000_000)
_PHASE_DETECTOR_HZ = (10_000_000, 133_000_000)
#: Clocks behind the input's divider, MHz, from which on the filter is the next one, from 1 on.
_FILTERS_MHZ = (17, 26, 44, 66, 101)
#: A block RAM reads 0 for about 3 us after configuration; five times that, as Amaranth waits.
_MEMORY_S = 15e-6


@dataclass(frozen=True)
class Ice40Pll:
    """``oscillator_hz * feedback / reference / 2^shift``."""

    oscillator_hz: int
    reference: int
    feedback: int
    shift: int

    @property
    def filter(self) -> int:
        """Range of its filter."""
        mhz = self.oscillator_hz / self.reference / 1e6
        return 1 + sum(mhz >= limit for limit in _FILTERS_MHZ)


def ice40_pll(*, oscillator_hz: int, clock_hz: int) -> Ice40Pll:
    """Factors that make ``clock_hz``.

    Raises
    ------
    InputError
        The PLL cannot make ``clock_hz``.
    """
    slowest, fastest = _PHASE_DETECTOR_HZ
    for reference in range(1, oscillator_hz // slowest + 1):
        for shift in range(1, 7):
            feedback, remainder = divmod(clock_hz * reference << shift, oscillator_hz)
            inner = oscillator_hz * feedback / reference
            if (
                not remainder
                and 1 <= feedback <= 128
                and VCO_HZ[0] <= inner <= VCO_HZ[1]
                and oscillator_hz / reference <= fastest
            ):
                return Ice40Pll(oscillator_hz, reference, feedback, shift)
    raise InputError.at(
        "clock",
        wanted=f"{oscillator_hz / 1e6:g} MHz * n / 2^k from {VCO_HZ[0] / 2**6 / 1e6:.1f} MHz on, "
        "with 533 to 1066 MHz before the last divider",
        found=f"{clock_hz / 1e6:g} MHz",
        fix=f"choose {oscillator_hz / 1e6:g} or {2 * oscillator_hz / 1e6:g}, for example",
    )


def ice40_clock(oscillator_hz: int, clock_hz: int) -> Clock | None:
    """Source of the clock; None if it is the oscillator's, which Amaranth's platform connects."""
    if clock_hz == oscillator_hz:
        return None
    return Ice40PllClock(pll=ice40_pll(oscillator_hz=oscillator_hz, clock_hz=clock_hz))


class Ice40PllClock(Clock):
    """Clock of domain ``sync`` from the board's oscillator through a PLL, with a reset.

    The reset ends when the PLL is locked and block RAM can be read; it begins anew without lock.

    Parameters
    ----------
    pll : Ice40Pll
        Factors.
    """

    reset_less = False

    def __init__(self, *, pll: Ice40Pll) -> None:
        self.pll = pll

    def elaborate(self, platform: Any) -> Module:
        """PLL at the oscillator's pin, and a timer."""
        m = Module()
        pll = self.pll
        clock_hz = pll.oscillator_hz * pll.feedback / pll.reference / 2**pll.shift
        m.domains.always = ClockDomain(reset_less=True, local=True)
        fast = Signal()
        locked = Signal()
        steady = Signal()
        m.submodules.pll = Instance(
            "SB_PLL40_PAD",
            p_FEEDBACK_PATH="SIMPLE",
            p_DIVR=Const(pll.reference - 1, 4),
            p_DIVF=Const(pll.feedback - 1, 7),
            p_DIVQ=Const(pll.shift, 3),
            p_FILTER_RANGE=Const(pll.filter, 3),
            i_PACKAGEPIN=platform.request(platform.default_clk, dir="-").io,
            i_RESETB=Const(1),
            i_BYPASS=Const(0),
            o_PLLOUTGLOBAL=fast,
            o_LOCK=locked,
        )
        m.d.comb += [ClockSignal("always").eq(fast), ClockSignal("sync").eq(fast)]
        m.submodules.lock = FFSynchronizer(locked, steady, o_domain="always")
        waits = round(_MEMORY_S * clock_hz)
        timer = Signal(range(waits + 1))
        ready = Signal()
        m.d.always += ready.eq(timer == waits)
        with m.If(~steady):
            m.d.always += timer.eq(0)
        with m.Elif(timer != waits):
            m.d.always += timer.eq(timer + 1)
        m.d.comb += ResetSignal("sync").eq(~ready)
        return m
