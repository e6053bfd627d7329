"""Clock of the core on a board: the oscillator itself, or that of a PLL, by family."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from amaranth.hdl import (
    ClockDomain,
    ClockSignal,
    Const,
    Elaboratable,
    Instance,
    Module,
    ResetSignal,
    Signal,
)
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer

from boresight.model.errors import InputError


@dataclass(frozen=True)
class Pll:
    """Dividers of a PLL: of its input, of its feedback, of its inner oscillator; each family's own.

    With ``second``, of an ECP5, the clock is that of the inner oscillator divided by it.
    """

    oscillator_hz: int
    reference: int
    feedback: int
    output: int
    second: int | None = None


@dataclass(eq=False)
class Clock(Elaboratable):
    """Source of domain ``sync``, which is to be defined by the parent, from the board's oscillator.

    Attributes
    ----------
    pll : Pll
    reset_less : bool
        Whether the domain has no reset: then the clock starts when registers and memories hold what
        they were configured with.
    """

    pll: Pll
    reset_less: ClassVar[bool] = True

    @staticmethod
    def factors(oscillator_hz: int, clock_hz: int) -> Pll:
        """Dividers that make ``clock_hz``; raises InputError if the PLL cannot make it."""
        raise NotImplementedError

    @classmethod
    def of(cls, oscillator_hz: int, clock_hz: int) -> Clock | None:
        """Source of a clock; None if it is the oscillator's, which Amaranth's platform connects.

        Raises
        ------
        InputError
            The PLL cannot make ``clock_hz``.
        """
        return None if clock_hz == oscillator_hz else cls(cls.factors(oscillator_hz, clock_hz))


class Spartan6Clock(Clock):
    """Clock ``oscillator_hz * feedback / output``, without reset.

    It starts when the configuration has ended and the PLL is locked.
    """

    #: Legal frequencies of the oscillator inside the PLL, and the fastest global clock, Hz: grade
    #: -2, the former with a margin.
    VCO_HZ = (400_000_000, 900_000_000)
    CLOCK_MAX_HZ = 375_000_000

    @staticmethod
    def factors(oscillator_hz: int, clock_hz: int) -> Pll:
        """See `Clock`; those with the fastest inner oscillator."""
        (low, high), most = Spartan6Clock.VCO_HZ, Spartan6Clock.CLOCK_MAX_HZ
        if isinstance(clock_hz, int) and 0 < clock_hz <= most:
            for multiply in range(64, 0, -1):
                divide, remainder = divmod(oscillator_hz * multiply, clock_hz)
                if low <= oscillator_hz * multiply <= high and not remainder and 1 <= divide <= 128:
                    return Pll(oscillator_hz, 1, multiply, divide)
        raise InputError.at(
            "clock_hz",
            wanted=f"a whole number up to {most} Hz that is {oscillator_hz} Hz * m "
            f"/ d with {oscillator_hz} Hz * m from {low} to {high} Hz",
            found=repr(clock_hz),
            fix=f"choose {oscillator_hz} or, for example, {2 * oscillator_hz}",
        )

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
            p_CLKFBOUT_MULT=self.pll.feedback,
            p_CLKOUT0_DIVIDE=self.pll.output,
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


class Ice40Clock(Clock):
    """Clock ``oscillator_hz * feedback / reference / 2^output``, with a reset.

    The reset ends when the PLL is locked and block RAM can be read; it begins anew without lock.
    """

    reset_less = False
    #: Legal frequencies of the oscillator inside the PLL, and of the clock behind the divider of
    #: its input, Hz (data sheet FPGA-DS-02008).
    VCO_HZ = (533_000_000, 1_066_000_000)
    PHASE_DETECTOR_HZ = (10_000_000, 133_000_000)
    #: Clocks behind the input's divider, MHz, from which on the filter is the next one, from 1 on.
    FILTERS_MHZ = (17, 26, 44, 66, 101)
    #: A block RAM reads 0 for about 3 us after configuration; five times that, as Amaranth waits.
    MEMORY_S = 15e-6

    @staticmethod
    def factors(oscillator_hz: int, clock_hz: int) -> Pll:
        """See `Clock`."""
        vco_hz = Ice40Clock.VCO_HZ
        slowest, fastest = Ice40Clock.PHASE_DETECTOR_HZ
        for reference in range(1, oscillator_hz // slowest + 1):
            for shift in range(1, 7):
                feedback, remainder = divmod(clock_hz * reference << shift, oscillator_hz)
                inner = oscillator_hz * feedback / reference
                if (
                    not remainder
                    and 1 <= feedback <= 128
                    and vco_hz[0] <= inner <= vco_hz[1]
                    and oscillator_hz / reference <= fastest
                ):
                    return Pll(oscillator_hz, reference, feedback, shift)
        raise InputError.at(
            "clock",
            wanted=f"{oscillator_hz / 1e6:g} MHz * n / 2^k from {vco_hz[0] / 2**6 / 1e6:.1f} MHz "
            "on, with 533 to 1066 MHz before the last divider",
            found=f"{clock_hz / 1e6:g} MHz",
            fix=f"choose {oscillator_hz / 1e6:g} or {2 * oscillator_hz / 1e6:g}, for example",
        )

    @property
    def filter(self) -> int:
        """Range of the PLL's filter."""
        mhz = self.pll.oscillator_hz / self.pll.reference / 1e6
        return 1 + sum(mhz >= limit for limit in self.FILTERS_MHZ)

    def elaborate(self, platform: Any) -> Module:
        """PLL at the oscillator's pin, and a timer."""
        m = Module()
        pll = self.pll
        clock_hz = pll.oscillator_hz * pll.feedback / pll.reference / 2**pll.output
        m.domains.always = ClockDomain(reset_less=True, local=True)
        fast = Signal()
        locked = Signal()
        steady = Signal()
        m.submodules.pll = Instance(
            "SB_PLL40_PAD",
            p_FEEDBACK_PATH="SIMPLE",
            p_DIVR=Const(pll.reference - 1, 4),
            p_DIVF=Const(pll.feedback - 1, 7),
            p_DIVQ=Const(pll.output, 3),
            p_FILTER_RANGE=Const(self.filter, 3),
            i_PACKAGEPIN=platform.request(platform.default_clk, dir="-").io,
            i_RESETB=Const(1),
            i_BYPASS=Const(0),
            o_PLLOUTGLOBAL=fast,
            o_LOCK=locked,
        )
        m.d.comb += [ClockSignal("always").eq(fast), ClockSignal("sync").eq(fast)]
        m.submodules.lock = FFSynchronizer(locked, steady, o_domain="always")
        waits = round(self.MEMORY_S * clock_hz)
        timer = Signal(range(waits + 1))
        ready = Signal()
        m.d.always += ready.eq(timer == waits)
        with m.If(~steady):
            m.d.always += timer.eq(0)
        with m.Elif(timer != waits):
            m.d.always += timer.eq(timer + 1)
        m.d.comb += ResetSignal("sync").eq(~ready)
        return m


class Ecp5Clock(Clock):
    """Clock ``oscillator_hz * feedback / reference``; ``output`` times that is inside. No reset.

    Registers start as configured, and the clock starts two periods of the oscillator after
    configuration has ended and the PLL is locked. Without lock it stops.
    """

    #: Legal frequencies of the oscillator inside the PLL, its best one, the least behind the
    #: divider of its input, and the fastest clock, Hz (data sheet FPGA-DS-02012).
    VCO_HZ = (400_000_000, 800_000_000)
    VCO_BEST_HZ = 600_000_000
    PHASE_DETECTOR_HZ = 10_000_000
    CLOCK_MAX_HZ = 400_000_000

    @staticmethod
    def factors(oscillator_hz: int, clock_hz: int) -> Pll:
        """See `Clock`; those with the inner oscillator nearest to 600 MHz."""
        (low, high), most = Ecp5Clock.VCO_HZ, Ecp5Clock.CLOCK_MAX_HZ
        references = range(1, oscillator_hz // Ecp5Clock.PHASE_DETECTOR_HZ + 1)
        for reference in references:
            feedback, remainder = divmod(clock_hz * reference, oscillator_hz)
            outputs = [n for n in range(1, 129) if low <= clock_hz * n <= high]
            if not remainder and 1 <= feedback <= 80 and outputs and clock_hz <= most:
                output = min(outputs, key=lambda n: abs(clock_hz * n - Ecp5Clock.VCO_BEST_HZ))
                return Pll(oscillator_hz, reference, feedback, output)
        second = [
            Pll(oscillator_hz, reference, factor // output, output, n)
            for reference in references
            for n in range(1, 129)
            for factor, remainder in [divmod(clock_hz * n * reference, oscillator_hz)]
            if not remainder and low <= clock_hz * n <= high and clock_hz <= most
            for output in range(1, 129)
            if factor % output == 0
            and factor // output <= 80
            and oscillator_hz * (factor // output) <= most * reference
        ]
        if second:
            return second[0]
        step = oscillator_hz / references[-1] / 1e6
        raise InputError.at(
            "clock",
            wanted=f"a multiple of {step:g} MHz up to 400 MHz, or one from 400 to 800 MHz by n",
            found=f"{clock_hz / 1e6:g} MHz",
            fix=f"choose {max(1, round(clock_hz / 1e6 / step)) * step:g}, for example",
        )

    def elaborate(self, platform: Any) -> Module:
        """Pad, PLL, gate of the clock network."""
        m = Module()
        pll = self.pll
        clkop_hz = pll.oscillator_hz * pll.feedback / pll.reference
        m.submodules.pad = pad = io.Buffer("i", platform.request(platform.default_clk, dir="-"))
        m.domains.oscillator = ClockDomain(reset_less=True, local=True)
        fast = made = Signal()
        second: dict[str, Any] = {}
        if pll.second is not None:
            fast = Signal()
            second = {
                "a_FREQUENCY_PIN_CLKOS": f"{clkop_hz * pll.output / pll.second / 1e6:g}",
                "p_CLKOS_ENABLE": "ENABLED",
                "p_CLKOS_DIV": pll.second,
                "p_CLKOS_CPHASE": (pll.output - 1) // 2,
                "p_CLKOS_FPHASE": 0,
                "o_CLKOS": fast,
            }
        locked = Signal()
        started = Signal()
        m.d.comb += ClockSignal("oscillator").eq(pad.i)
        # Parameters as Project Trellis' ecppll gives them.
        m.submodules.pll = Instance(
            "EHXPLLL",
            a_FREQUENCY_PIN_CLKI=f"{pll.oscillator_hz / 1e6:g}",
            a_FREQUENCY_PIN_CLKOP=f"{clkop_hz / 1e6:g}",
            a_ICP_CURRENT="12",
            a_LPF_RESISTOR="8",
            a_MFG_ENABLE_FILTEROPAMP="1",
            a_MFG_GMCREF_SEL="2",
            p_PLLRST_ENA="DISABLED",
            p_INTFB_WAKE="DISABLED",
            p_STDBY_ENABLE="DISABLED",
            p_DPHASE_SOURCE="DISABLED",
            p_OUTDIVIDER_MUXA="DIVA",
            p_OUTDIVIDER_MUXB="DIVB",
            p_OUTDIVIDER_MUXC="DIVC",
            p_OUTDIVIDER_MUXD="DIVD",
            p_CLKI_DIV=pll.reference,
            p_CLKOP_ENABLE="ENABLED",
            p_CLKOP_DIV=pll.output,
            p_CLKOP_CPHASE=(pll.output - 1) // 2,
            p_CLKOP_FPHASE=0,
            p_FEEDBK_PATH="CLKOP",
            p_CLKFB_DIV=pll.feedback,
            **{f"i_{name}": Const(0) for name in ("RST", "STDBY", "PLLWAKESYNC", "ENCLKOP")},
            **{f"i_PHASE{name}": Const(0) for name in ("SEL0", "SEL1")},
            **{f"i_PHASE{name}": Const(1) for name in ("DIR", "STEP", "LOADREG")},
            i_CLKI=pad.i,
            i_CLKFB=made,
            o_CLKOP=made,
            **second,
            o_LOCK=locked,
        )
        # Configuration clears these flip-flops, so they open the gate after it has ended.
        m.submodules.lock = FFSynchronizer(locked, started, o_domain="oscillator")
        m.submodules.gate = Instance("DCCA", i_CLKI=fast, i_CE=started, o_CLKO=ClockSignal("sync"))
        return m
