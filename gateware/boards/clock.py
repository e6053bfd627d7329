"""Clock of the core on a board: the oscillator itself, or that of a PLL, by family."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from math import inf
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
    """Source of domain ``sync``, which the parent defines, from the board's oscillator."""

    pll: Pll
    #: Whether the domain has no reset: then the clock starts when registers and memories hold what
    #: they were configured with.
    reset_less: ClassVar[bool] = True
    #: Legal frequencies of the oscillator inside the PLL, and behind the divider of its input.
    vco_hz: ClassVar[tuple[int, int]]
    input_hz: ClassVar[tuple[int, float]] = (10_000_000, inf)
    clock_max_hz: ClassVar[int]
    #: Dividers behind the inner oscillator.
    outputs: ClassVar[Iterable[int]] = range(1, 129)

    @classmethod
    def ratios(cls, oscillator_hz: int, clock_hz: int) -> Iterator[tuple[int, int, int]]:
        """Divider of the input, multiple and divider of the inner oscillator, for a clock."""
        slowest, fastest = cls.input_hz
        for reference, output in product(range(1, 1 + oscillator_hz // slowest), cls.outputs):
            multiple, rest = divmod(clock_hz * output * reference, oscillator_hz)
            legal = cls.vco_hz[0] <= clock_hz * output <= cls.vco_hz[1]
            legal = legal and oscillator_hz <= fastest * reference
            if legal and not rest and clock_hz <= cls.clock_max_hz:
                yield reference, multiple, output

    @classmethod
    def plls(cls, oscillator_hz: int, clock_hz: int) -> Iterator[Pll]:
        """Dividers that make a clock, the best first."""
        raise NotImplementedError

    @classmethod
    def of(cls, oscillator_hz: int, clock_hz: int) -> Clock | None:
        """Source of a clock; None if it is the oscillator's, which Amaranth's platform connects.

        Raises InputError if the PLL cannot make ``clock_hz``.
        """
        if clock_hz == oscillator_hz:
            return None
        if pll := next(cls.plls(oscillator_hz, clock_hz), None):
            return cls(pll)
        rates = range(10**6, cls.clock_max_hz + 1, 10**6)
        legal = (hz for hz in rates if next(cls.plls(oscillator_hz, hz), None))
        raise InputError.at(
            "clock",
            wanted=f"a clock that the PLL makes of {oscillator_hz / 1e6:g} MHz",
            found=f"{clock_hz / 1e6:g} MHz",
            fix=f"choose {min(legal, key=lambda hz: abs(hz - clock_hz)) // 10**6}, for example",
        )


class Spartan6Clock(Clock):
    """Clock ``oscillator_hz * feedback / output``, without reset.

    It starts when the configuration has ended and the PLL is locked. Limits are those of grade -2,
    inside with a margin.
    """

    vco_hz = (400_000_000, 900_000_000)
    clock_max_hz = 375_000_000

    @classmethod
    def plls(cls, oscillator_hz: int, clock_hz: int) -> Iterator[Pll]:
        """See `Clock`; those with the fastest inner oscillator first."""
        for reference, feedback, output in sorted(cls.ratios(oscillator_hz, clock_hz))[::-1]:
            if reference == 1 and feedback <= 64:
                yield Pll(oscillator_hz, 1, feedback, output)

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.submodules.pad = pad = io.Buffer("i", platform.request(platform.default_clk, dir="-"))
        names = ("feedback", "fast", "locked", "started")
        feedback, fast, locked, started = (Signal(name=name) for name in names)
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
    Limits are those of data sheet FPGA-DS-02008.
    """

    reset_less = False
    vco_hz = (533_000_000, 1_066_000_000)
    input_hz = (10_000_000, 133_000_000)
    clock_max_hz = 533_000_000
    outputs = tuple(2**k for k in range(1, 7))
    #: Clocks behind the input's divider, MHz, from which on the filter is the next one, from 1 on.
    FILTERS_MHZ = (17, 26, 44, 66, 101)
    #: A block RAM reads 0 for about 3 us after configuration; five times that, as Amaranth waits.
    MEMORY_S = 15e-6

    @classmethod
    def plls(cls, oscillator_hz: int, clock_hz: int) -> Iterator[Pll]:
        for reference, feedback, output in cls.ratios(oscillator_hz, clock_hz):
            if feedback <= 128:
                yield Pll(oscillator_hz, reference, feedback, output.bit_length() - 1)

    @property
    def filter(self) -> int:
        mhz = self.pll.oscillator_hz / self.pll.reference / 1e6
        return 1 + sum(mhz >= limit for limit in self.FILTERS_MHZ)

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        pll = self.pll
        clock_hz = pll.oscillator_hz * pll.feedback / pll.reference / 2**pll.output
        m.domains.always = ClockDomain(reset_less=True, local=True)
        names = ("fast", "locked", "steady", "ready")
        fast, locked, steady, ready = (Signal(name=name) for name in names)
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
    configuration has ended and the PLL is locked. Without lock it stops. Limits are those of data
    sheet FPGA-DS-02012.
    """

    vco_hz = (400_000_000, 800_000_000)
    clock_max_hz = 400_000_000

    @classmethod
    def plls(cls, oscillator_hz: int, clock_hz: int) -> Iterator[Pll]:
        """See `Clock`; the first output with the inner oscillator near 600 MHz, then the second."""
        ratios = [*cls.ratios(oscillator_hz, clock_hz)]
        first = (
            Pll(oscillator_hz, reference, multiple // output, output)
            for reference, multiple, output in ratios
            if multiple % output == 0 and multiple // output <= 80
        )
        yield from sorted(first, key=lambda p: (p.reference, abs(clock_hz * p.output - 600e6)))
        for (reference, multiple, second), output in product(ratios, cls.outputs):
            feedback, rest = divmod(multiple, output)
            fits = feedback <= 80 and oscillator_hz * feedback <= cls.clock_max_hz * reference
            if not rest and fits:
                yield Pll(oscillator_hz, reference, feedback, output, second)

    def elaborate(self, platform: Any) -> Module:
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
        locked, started = Signal(name="locked"), Signal(name="started")
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
            **dict.fromkeys(("p_PLLRST_ENA", "p_INTFB_WAKE"), "DISABLED"),
            **dict.fromkeys(("p_STDBY_ENABLE", "p_DPHASE_SOURCE"), "DISABLED"),
            **{f"p_OUTDIVIDER_MUX{output}": f"DIV{output}" for output in "ABCD"},
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
