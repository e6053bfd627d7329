"""Clock of the core on a board with an ECP5: the oscillator itself, or a PLL's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from amaranth.hdl import ClockDomain, ClockSignal, Const, Instance, Module, Signal
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer

from boresight.gateware.boards.clock import Clock
from boresight.model.errors import InputError

#: Legal frequencies of the oscillator inside the PLL, its best one, and the least behind the
#: divider of its input, Hz (data sheet FPGA-DS-02012).
VCO_HZ = (400_000_000, 800_000_000)
_VCO_BEST_HZ = 600_000_000
_PHASE_DETECTOR_HZ = 10_000_000
#: Fastest clock of the PLL's output, Hz.
CLOCK_MAX_HZ = 400_000_000


@dataclass(frozen=True)
class Ecp5Pll:
    """``oscillator_hz * feedback / reference``; ``output`` times that is the inner oscillator.

    With ``second`` the clock is that of the inner oscillator divided by it, by a second output.
    """

    oscillator_hz: int
    reference: int
    feedback: int
    output: int
    second: int | None = None


def ecp5_pll(*, oscillator_hz: int, clock_hz: int) -> Ecp5Pll:
    """Factors that make ``clock_hz``, with the inner oscillator nearest to 600 MHz.

    Raises
    ------
    InputError
        The PLL cannot make ``clock_hz``.
    """
    low, high = VCO_HZ
    references = range(1, oscillator_hz // _PHASE_DETECTOR_HZ + 1)
    for reference in references:
        feedback, remainder = divmod(clock_hz * reference, oscillator_hz)
        outputs = [n for n in range(1, 129) if low <= clock_hz * n <= high]
        if not remainder and 1 <= feedback <= 80 and outputs and clock_hz <= CLOCK_MAX_HZ:
            output = min(outputs, key=lambda n: abs(clock_hz * n - _VCO_BEST_HZ))
            return Ecp5Pll(oscillator_hz, reference, feedback, output)
    second = [
        Ecp5Pll(oscillator_hz, reference, factor // output, output, n)
        for reference in references
        for n in range(1, 129)
        for factor, remainder in [divmod(clock_hz * n * reference, oscillator_hz)]
        if not remainder and low <= clock_hz * n <= high and clock_hz <= CLOCK_MAX_HZ
        for output in range(1, 129)
        if factor % output == 0
        and factor // output <= 80
        and oscillator_hz * (factor // output) <= CLOCK_MAX_HZ * reference
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


def ecp5_clock(oscillator_hz: int, clock_hz: int) -> Clock | None:
    """Source of the clock; None if it is the oscillator's, which Amaranth's platform connects."""
    if clock_hz == oscillator_hz:
        return None
    return Ecp5PllClock(pll=ecp5_pll(oscillator_hz=oscillator_hz, clock_hz=clock_hz))


class Ecp5PllClock(Clock):
    """Clock of domain ``sync`` from the board's oscillator through a PLL, without reset.

    Registers start as configured, and the clock starts two periods of the oscillator after
    configuration has ended and the PLL is locked. Without lock it stops.

    Parameters
    ----------
    pll : Ecp5Pll
        Factors.
    """

    def __init__(self, *, pll: Ecp5Pll) -> None:
        self.pll = pll

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
