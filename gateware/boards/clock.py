"""Clock of the core on a board with a Spartan-6: the oscillator itself, or a PLL's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from amaranth.hdl import ClockSignal, Const, Elaboratable, Instance, Module, Signal
from amaranth.lib import io

from boresight.model.errors import InputError

#: Legal frequencies of the oscillator inside the PLL, Hz; grade -2 with a margin.
VCO_HZ = (400_000_000, 900_000_000)
#: Fastest global clock, Hz: grade -2.
CLOCK_MAX_HZ = 375_000_000


class Clock(Elaboratable):
    """Source of domain ``sync``, which is to be defined by the parent.

    Attributes
    ----------
    reset_less : bool
        Whether the domain has no reset: then the clock starts when registers and memories hold what
        they were configured with.
    """

    reset_less: ClassVar[bool] = True


@dataclass(frozen=True)
class Pll:
    """``oscillator_hz * multiply / divide``."""

    oscillator_hz: int
    multiply: int
    divide: int


def pll_for(*, oscillator_hz: int, clock_hz: int) -> Pll | None:
    """Factors that make ``clock_hz``, with the fastest inner oscillator; None if no PLL is needed.

    Raises
    ------
    InputError
        The PLL cannot make ``clock_hz``.
    """
    if clock_hz == oscillator_hz:
        return None
    low, high = VCO_HZ
    if isinstance(clock_hz, int) and 0 < clock_hz <= CLOCK_MAX_HZ:
        for multiply in range(64, 0, -1):
            divide, remainder = divmod(oscillator_hz * multiply, clock_hz)
            if low <= oscillator_hz * multiply <= high and not remainder and 1 <= divide <= 128:
                return Pll(oscillator_hz, multiply, divide)
    raise InputError.at(
        "clock_hz",
        wanted=f"a whole number up to {CLOCK_MAX_HZ} Hz that is {oscillator_hz} Hz * m "
        f"/ d with {oscillator_hz} Hz * m from {low} to {high} Hz",
        found=repr(clock_hz),
        fix=f"choose {oscillator_hz} or, for example, {2 * oscillator_hz}",
    )


def spartan6_clock(oscillator_hz: int, clock_hz: int) -> Clock | None:
    """Source of the clock; None if it is the oscillator's, which Amaranth's platform connects."""
    pll = pll_for(oscillator_hz=oscillator_hz, clock_hz=clock_hz)
    return None if pll is None else PllClock(pll=pll)


class PllClock(Clock):
    """Clock of domain ``sync`` from the board's oscillator through a PLL, without reset.

    The clock starts when the configuration has ended and the PLL is locked.

    Parameters
    ----------
    pll : Pll
        Factors.
    """

    def __init__(self, *, pll: Pll) -> None:
        self.pll = pll

    def elaborate(self, platform: Any) -> Module:
        """Pad, PLL, gated global buffer."""
        m = Module()
        m.submodules.pad = pad = io.Buffer("i", platform.request(platform.default_clk, dir="-"))
        feedback = Signal()
        fast = Signal()
        locked = Signal()
        started = Signal()
        m.submodules.pll = Instance(
            "PLL_BASE",
            p_COMPENSATION="INTERNAL",
            p_BANDWIDTH="OPTIMIZED",
            p_CLKIN_PERIOD=1e9 / self.pll.oscillator_hz,
            p_DIVCLK_DIVIDE=1,
            p_CLKFBOUT_MULT=self.pll.multiply,
            p_CLKOUT0_DIVIDE=self.pll.divide,
            i_CLKIN=pad.i,
            i_CLKFBIN=feedback,
            i_RST=Const(0),
            o_CLKFBOUT=feedback,
            o_CLKOUT0=fast,
            o_LOCKED=locked,
        )
        m.submodules.startup = Instance("STARTUP_SPARTAN6", o_EOS=started)
        m.submodules.gate = Instance(
            "BUFGCE", i_CE=locked & started, i_I=fast, o_O=ClockSignal("sync")
        )
        return m
