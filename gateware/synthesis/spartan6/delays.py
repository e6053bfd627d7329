"""Delays of Spartan-6 cells and nets, grades -2 and -3, slow corner, in nanoseconds.

There is no public Spartan-6 timing database. The figures here are of three kinds, and each record
says which:

* *observed*: a speed-file constant printed in a published ISE timing report, or a difference of
  two such constants (``guessed`` is False);
* *statistics*: the median or upper quartile of routed net delays in those reports, by fanout
  (``guessed`` is False: it is a measured statistic, though of other people's designs);
* *guessed*: no report showed the value (``guessed`` is True). The source then says what the guess
  rests on. A timing report lists the guesses that its worst path depends on.

None of this replaces the ``trce`` tool of ISE, which alone can sign a design off.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

#: Speed grades with data, slow first.
GRADES: Final = (2, 3)
#: Statistics of routed net delays, used for a net.
NET_MODELS: Final = ("median", "p75")


@dataclass(frozen=True)
class Delay:
    """One timing constant.

    Attributes
    ----------
    ns : float
        Nanoseconds, >= 0.
    source : str
        Where it comes from.
    guessed : bool
        True if no timing report showed it.
    """

    ns: float
    source: str
    guessed: bool = False


class DelayTable(Mapping[str, Delay]):
    """All constants of one grade and one net model, by name.

    Attributes
    ----------
    grade : int
        Speed grade, 2 or 3.
    nets : str
        Net model, ``median`` or ``p75``.
    """

    def __init__(self, *, grade: int, nets: str, delays: Mapping[str, Delay]) -> None:
        self.grade = grade
        self.nets = nets
        self._delays = MappingProxyType(dict(delays))

    def __getitem__(self, key: str) -> Delay:
        return self._delays[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._delays)

    def __len__(self) -> int:
        return len(self._delays)

    def total(self, keys: tuple[str, ...]) -> float:
        """Return the sum of the named delays, in ns."""
        return math.fsum(self._delays[key].ns for key in keys)

    def replaced(self, **delays: Delay) -> "DelayTable":
        """Return a copy with some constants exchanged, for what-if questions."""
        for key in delays:
            if key not in self._delays:
                raise ValueError(f"delay name must be one of the table's, not {key!r}")
        return DelayTable(grade=self.grade, nets=self.nets, delays={**self._delays, **delays})


_REPORTS = {
    2: "ISE trce reports, speed files PRODUCTION 1.23, 39 of -2 (16 of them XC6SLX9)",
    3: "ISE trce reports, speed files PRODUCTION 1.23, 25 of -3 (19 of them XC6SLX9)",
}
_SCALED = "borrowed from the -3 value, times about 1.15"


def _pair(
    arc: str, ns2: float, ns3: float, guess2: str = "", guess3: str = ""
) -> tuple[Delay, Delay]:
    """Make the -2 and -3 records of one constant; a non-empty guess text marks a guess."""

    def delay(grade: int, ns: float, guess: str) -> Delay:
        if guess:
            return Delay(ns, f"{arc}: guess, {guess}", True)
        return Delay(ns, f"{arc}: {_REPORTS[grade]}")

    return delay(2, ns2, guess2), delay(3, ns3, guess3)


def _guess(arc: str, ns2: float, ns3: float, why: str, why2: str = "") -> tuple[Delay, Delay]:
    return _pair(arc, ns2, ns3, why2 or why, why)


def _slice_delays() -> dict[str, tuple[Delay, Delay]]:
    """Flip-flops, LUTs, wide multiplexers, shift registers and LUT RAM."""
    ram = "of the order of yosys's Artix-7 cell models"
    d = {
        "ff_clk_q": _pair("flip-flop clock to Q (Tcko, slowest slice kind)", 0.525, 0.447),
        "ff_d": _pair("flip-flop D setup from the bypass pin (Tdick)", 0.114, 0.136),
        "ff_d_lut": _pair("D setup behind a LUT of the slice (Tas minus Tilo)", 0.114, 0.080),
        "ff_ce": _pair("clock-enable setup (Tceck)", 0.408, 0.331),
        "ff_sr": _pair("set/reset setup (Tsrck); used for asynchronous recovery too", 0.470, 0.390),
        "lut": _pair("LUT input to output (Tilo, slowest seen)", 0.259, 0.261),
        "mux7": _pair(
            "F7 data input to output (Tilo through F7 minus Tilo)",
            0.078,
            0.080,
            "",
            "the reports do not separate F7 from F8 on -3",
        ),
        "mux8": _pair(
            "F8 data input to output (Tilo through F8 minus Tilo through F7)",
            0.093,
            0.090,
            "",
            "the reports do not separate F7 from F8 on -3",
        ),
        "mux_select": _guess("F7/F8 select to output", 0.22, 0.22, "near one LUT delay"),
        "srl_clk_q": _guess("shift-register LUT clock to output", 1.47, 1.30, ram),
        "srl_address": _guess("shift-register address to output", 0.259, 0.261, "as one LUT"),
        "srl_setup": _guess("shift-register data and enable setup", 0.40, 0.40, "near Tceck"),
        "lutram_clk_q": _guess("LUT RAM write clock to output", 1.20, 1.05, ram),
        "lutram_address": _guess("LUT RAM read address to output", 0.259, 0.261, "as one LUT"),
        "lutram_setup": _guess("LUT RAM data, address, enable setup", 0.40, 0.40, "as the SRL"),
    }
    return d


def _carry_delays() -> dict[str, tuple[Delay, Delay]]:
    """CARRY4: entry at S[k] or DI[k], ripple CI to CO[3], exit at O[i] or CO[i]."""
    d: dict[str, tuple[Delay, Delay]] = {}
    s_co = ((0.236, 0.134), (0.224, 0.114), (0.092, 0.034), (0.084, 0.030))
    di_co = ((0.281, 0.250), (0.197, 0.170), (0.134, 0.120), (0.121, 0.110))
    ci_o = ((0.220, 0.190), (0.310, 0.260), (0.302, 0.260), (0.320, 0.280))
    for k, letter in enumerate("abcd"):
        d[f"carry_s{k}_co"] = _pair(
            f"S[{k}] to CO[3] (Topcy{letter} minus Tilo)",
            *s_co[k],
            guess3="no -3 report showed Topcyd" if k == 3 else "",
        )
        d[f"carry_di{k}_co"] = _pair(
            f"DI[{k}] to CO[3] (T{letter}xcy)", *di_co[k], guess3="-2 times about 0.88"
        )
        d[f"carry_ci_o{k}"] = _pair(
            f"CI to O[{k}] (Tcin{letter})", *ci_o[k], guess3="-2 times about 0.86"
        )
    s_o2 = {
        (0, 0): 0.197,
        (0, 1): 0.273,
        (0, 2): 0.398,
        (0, 3): 0.450,
        (1, 1): 0.185,
        (1, 2): 0.381,
        (1, 3): 0.420,
        (2, 2): 0.246,
        (2, 3): 0.330,
        (3, 3): 0.200,
    }
    s_o3 = {
        (0, 0): 0.170,
        (0, 1): 0.267,
        (0, 2): 0.350,
        (0, 3): 0.400,
        (1, 1): 0.160,
        (1, 2): 0.330,
        (1, 3): 0.370,
        (2, 2): 0.210,
        (2, 3): 0.290,
        (3, 3): 0.180,
    }
    for (k, i), ns2 in s_o2.items():
        d[f"carry_s{k}_o{i}"] = _guess(
            f"S[{k}] to O[{i}]", ns2, s_o3[k, i], "split of Topcy and Tcin by bit position"
        )
    d["carry_di_o"] = _guess("DI entry, on top of S to O", 0.04, 0.04, "Taxcy minus Topcya")
    d["carry_ci_co"] = _pair("CI to CO[3] (Tbyp)", 0.093, 0.076)
    d["carry_cyinit"] = _guess("CYINIT entry, on top of CI", 0.10, 0.10, "one extra multiplexer")
    d["carry_exit"] = _guess(
        "CO leaving the slice through its output multiplexer", 0.12, 0.12, "near one F7 delay"
    )
    return d


def _memory_delays() -> dict[str, tuple[Delay, Delay]]:
    """Block RAM and clock network."""
    return {
        "ramb_clk_do": _pair(
            "block RAM clock to data, no output register (Trcko_DO)",
            2.10,
            1.85,
            guess3="between the 1.65 seen for one RAMB8 and the -2 value",
        ),
        "ramb_clk_do_reg": _guess(
            "block RAM clock to data with its output register", 1.75, 1.60, "no report used it"
        ),
        "ramb_address": _pair("block RAM address setup (Trcck_ADDR)", 0.400, 0.350),
        "ramb_setup": _guess(
            "block RAM data, write, enable setup", 0.400, 0.350, "taken equal to the address setup"
        ),
        "ramb_period": _pair("block RAM minimum clock period (Trper)", 3.570, 3.124),
        "bufg_period": _pair(
            "global clock buffer minimum period (Tbcper)",
            2.666,
            2.500,
            guess3="400 MHz, no -3 report checked it",
        ),
        "clock_uncertainty": _guess(
            "clock skew and jitter", 0.135, 0.135, "0.100 ns of skew plus 0.035 ns of jitter"
        ),
    }


_NEAR: Final = "no report showed this arc; set from arcs of the same length"


def _dsp_pin_delays() -> dict[str, tuple[Delay, Delay]]:
    """DSP48A1, from its pins. A register named in a key is the end of the arc."""

    def seen3(arc: str, ns2: float, ns3: float) -> tuple[Delay, Delay]:
        return _pair(arc, ns2, ns3, guess2=_SCALED)

    return {
        # pin to first register
        "dsp_su_b0": seen3("B setup to B0REG", 0.18, 0.149),
        "dsp_su_ab": _guess("A or B setup to A0REG, A1REG or B1REG", 0.18, 0.149, "as B0REG"),
        "dsp_su_c": seen3("C setup to CREG", 0.13, 0.105),
        "dsp_su_d": _guess("D setup to DREG", 0.18, 0.149, "as B0REG"),
        "dsp_su_mode": _guess("OPMODE, CARRYIN setup to their registers", 0.30, 0.30, _NEAR),
        "dsp_su_control": _guess("enable and reset setup", 0.30, 0.30, _NEAR),
        # pin through logic
        "dsp_preadd": _guess("B, D or OPMODE through the pre-adder", 2.30, 2.00, _NEAR),
        "dsp_ab_m": _guess("A or B through the multiplier, to MREG or pin M", 2.90, 2.50, _NEAR),
        "dsp_ab_p": seen3("A or B through multiplier and post-adder (B to PCOUT)", 3.60, 3.125),
        "dsp_ab_preg": _guess(
            "A or B to PREG, no MREG", 3.40, 2.925, "to P, less an output buffer"
        ),
        "dsp_c_p": _guess("C, D:A:B, OPMODE or CARRYIN to P", 2.60, 2.264, "as PCIN to P"),
        "dsp_c_preg": _guess(
            "C, D:A:B, OPMODE or CARRYIN to PREG", 2.40, 2.064, "to P, less an output buffer"
        ),
        "dsp_pcin_p": seen3("PCIN to P", 2.60, 2.264),
        "dsp_pcin_preg": _guess("PCIN to PREG", 2.40, 2.064, "to P, less an output buffer"),
        "dsp_b_bcout": _guess("B to BCOUT, no register", 0.60, 0.50, _NEAR),
    }


def _dsp_clock_delays() -> dict[str, tuple[Delay, Delay]]:
    """DSP48A1, from its registers, the end of the arc last in the key."""
    all_reg = "the data sheet's all-registers limit, 390 MHz (-3) and about 333 MHz (-2)"
    return {
        # register to output
        "dsp_preg_p": _guess("PREG clock to P or PCOUT", 1.40, 1.20, _NEAR),
        "dsp_mreg_m": _guess("MREG clock to M", 1.40, 1.20, _NEAR),
        "dsp_breg_bcout": _guess("B register clock to BCOUT", 1.40, 1.20, _NEAR),
        "dsp_mreg_p": _guess("MREG clock through the post-adder to P", 2.20, 1.90, _NEAR),
        "dsp_abreg_m": _guess("A or B register clock to M, no MREG", 3.20, 2.80, _NEAR),
        "dsp_abreg_p": _guess(
            "A or B register clock to P, no MREG",
            3.90,
            3.425,
            "A or B pin to P, plus a clock-to-output",
        ),
        "dsp_creg_p": _guess(
            "C, D, OPMODE or CARRYIN register clock to P",
            2.90,
            2.564,
            "C pin to P, plus a clock-to-output",
        ),
        # register to register
        "dsp_abreg_mreg": _guess("A or B register to MREG", 3.003, 2.564, all_reg),
        "dsp_abreg_preg": _guess(
            "A or B register to PREG, no MREG",
            3.90,
            3.425,
            "A or B pin to P, plus a clock-to-output",
        ),
        "dsp_mreg_preg": _guess("MREG to PREG", 2.30, 2.00, _NEAR),
        "dsp_creg_preg": _guess(
            "C, D, OPMODE or CARRYIN register to PREG",
            2.625,
            2.283,
            "the -3 period check CREG to CARRYOUTREG",
            _SCALED,
        ),
        "dsp_preg_preg": _guess(
            "PREG fed back to PREG",
            2.625,
            2.283,
            "the -3 period check CREG to CARRYOUTREG",
            _SCALED,
        ),
    }


#: Fanout classes of the net model: highest fanout of the class and its name.
_CLASSES: Final = ((1, "net_1"), (3, "net_2_3"), (8, "net_4_8"), (20, "net_9_20"))
_LAST: Final = "net_21_up"
#: Classes of nets by fan-out, small first.
NET_CLASSES: Final = (*(name for _, name in _CLASSES), _LAST)

#: Net statistics of -2, ns. The upper quartiles of neighbouring classes that came out of order
#: (1.29 then 1.16; 3.2 then 2.4) are pooled to their mean, for a net must not get faster by
#: having more loads.
_NETS_2: Final = {
    "net_1": (0.553, 0.829),
    "net_2_3": (0.855, 1.225),
    "net_4_8": (0.897, 1.225),
    "net_9_20": (1.10, 2.80),
    "net_21_up": (1.42, 2.80),
}
#: Mean ratio of -3 to -2 routed delays in the same reports.
_NET_RATIO_3: Final = 0.88


def fanout_key(fanout: int) -> str:
    """Return the name of the net delay for a net with ``fanout`` loads, >= 1."""
    if fanout < 1:
        raise ValueError(f"fanout must be at least 1, not {fanout!r}")
    for highest, name in _CLASSES:
        if fanout <= highest:
            return name
    return _LAST


def _net_delays(grade: int, nets: str) -> dict[str, Delay]:
    column = NET_MODELS.index(nets)
    ratio = 1.0 if grade == 2 else _NET_RATIO_3
    how = "" if grade == 2 else f", times {_NET_RATIO_3} for -3"
    source = f"{nets} of routed nets in 1,800 worst-path nets of -2 trce reports{how}"
    d = {name: Delay(round(v[column] * ratio, 3), source) for name, v in _NETS_2.items()}
    d["net_carry"] = Delay(0.003, f"carry chain net: {_REPORTS[grade]}")
    d["net_dsp"] = Delay(0.059, f"DSP cascade net: {_REPORTS[grade]}")
    return d


def delay_table(*, grade: int, nets: str) -> DelayTable:
    """Return the constants for one speed grade (2 or 3) and net model (``median``, ``p75``)."""
    if grade not in GRADES:
        raise ValueError(f"grade must be 2 or 3, not {grade!r}")
    if nets not in NET_MODELS:
        raise ValueError(f"nets must be 'median' or 'p75', not {nets!r}")
    cells = {**_slice_delays(), **_carry_delays(), **_memory_delays()}
    cells |= {**_dsp_pin_delays(), **_dsp_clock_delays()}
    column = GRADES.index(grade)
    delays = {name: pair[column] for name, pair in cells.items()}
    return DelayTable(grade=grade, nets=nets, delays={**delays, **_net_delays(grade, nets)})
